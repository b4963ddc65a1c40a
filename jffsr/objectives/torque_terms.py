"""Terms of the joint torques: their integral of Hu, Wang and Shi 2011, eq. (7), energy, work, peaks and limits.

Integrals over time are by Simpson's rule over the motion's samples. A motion that has its torques in it
(`with_joint_torque`) is not asked to compute them again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np

from jffsr.objectives.smoothing import Smoothing, overrun, smooth_overrun
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.joint_torque import with_joint_torque
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rounded_rotation_vector,
)
from jffsr.spatial.safe import peak, smooth_max, smooth_norm
from jffsr.types import Array, Quaternion, Scalar, Vector


def simpson_weights(num_steps: int) -> np.ndarray:
    """Weights (num_steps + 1,) of composite quadrature over [0, 1]: Simpson's 1/3 rule, the last three steps by 3/8.

    The 3/8 rule serves an odd number of steps alone; a single step is a trapezoid.
    """
    weights = np.zeros(num_steps + 1)
    if num_steps == 1:
        weights += 0.5
        return weights
    even = num_steps - 3 * (num_steps % 2)
    for k in range(0, even, 2):
        weights[k : k + 3] += np.array([1, 4, 1]) / 3
    if even < num_steps:
        weights[even:] += np.array([3, 9, 9, 3]) / 8
    return weights / num_steps


def integral(motion: Motion, samples: Array) -> Scalar:
    """Integral over the motion's time of samples (N + 1,)."""
    weights = simpson_weights(len(motion.time) - 1)
    return (motion.time[-1] - motion.time[0]) * jnp.dot(weights, samples)


def _torque(robot: Robot, motion: Motion) -> Array:
    return with_joint_torque(robot, motion).joint_torque


def _width(term_scale: Array, smoothing: Smoothing, motion: Motion) -> Scalar:
    """Rounding of one joint's |x| such that that of the whole integral is at most that of a norm of this scale."""
    spread = (motion.time[-1] - motion.time[0]) * motion.joint_position.shape[1]
    return smoothing.norm * term_scale / spread


@register_dataclass
@dataclass(frozen=True)
class TorqueIntegral:
    """Integral, N m s, of the sum over joints of |torque|: Hu, Wang and Shi 2011, eq. (7)."""

    scale: Array
    name: str = field(default="torque_integral", metadata={"static": True})
    unit = "N m s"
    needs_torque = True

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return integral(motion, jnp.sum(jnp.abs(_torque(robot, motion)), axis=-1))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form: sqrt(torque^2 + e^2) - e in place of |torque|."""
        rounded = smooth_norm(_torque(robot, motion)[..., None], _width(self.scale, smoothing, motion))
        return integral(motion, jnp.sum(rounded, axis=-1))


@register_dataclass
@dataclass(frozen=True)
class TorqueEnergy:
    """Integral, N^2 m^2 s, of the sum over joints of torque^2: what resistance turns to heat, but for a factor."""

    scale: Array
    name: str = field(default="torque_energy", metadata={"static": True})
    unit = "N^2 m^2 s"
    needs_torque = True

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The integral, which is smooth as it is."""
        return integral(motion, jnp.sum(_torque(robot, motion) ** 2, axis=-1))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The same."""
        return self.value(robot, motion)


@register_dataclass
@dataclass(frozen=True)
class MechanicalWork:
    """Integral, J, of the sum over joints of |torque x rate|: the work of drives that do not take energy back."""

    scale: Array
    name: str = field(default="mechanical_work", metadata={"static": True})
    unit = "J"
    needs_torque = True

    def _power(self, robot: Robot, motion: Motion) -> Array:
        return _torque(robot, motion) * motion.joint_velocity

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The integral of absolute values."""
        return integral(motion, jnp.sum(jnp.abs(self._power(robot, motion)), axis=-1))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        width = _width(self.scale, smoothing, motion)
        return integral(motion, jnp.sum(smooth_norm(self._power(robot, motion)[..., None], width), axis=-1))


@register_dataclass
@dataclass(frozen=True)
class PeakTorque:
    """Largest |torque|, N m or N, of any joint at any sample."""

    scale: Array
    name: str = field(default="peak_torque", metadata={"static": True})
    unit = "N m"
    needs_torque = True

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The peak."""
        return peak(jnp.abs(_torque(robot, motion)).ravel())

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """A log-sum-exp peak, never below the true one; its width is relative to the scale."""
        torque = _torque(robot, motion).ravel()
        return smooth_max(jnp.concatenate([torque, -torque]), smoothing.peak * self.scale)


@register_dataclass
@dataclass(frozen=True)
class JointTorque:
    """Sum over joints of the relative overrun of the peak torque over `limit` (n,), in the form of Li's eq. (39)."""

    scale: Array
    limit: Array
    name: str = field(default="joint_torque", metadata={"static": True})
    unit = "relative"
    needs_torque = True

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The overrun of the samples' peaks."""
        return overrun(_torque(robot, motion), self.limit)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return smooth_overrun(_torque(robot, motion), self.limit, smoothing)


@register_dataclass
@dataclass(frozen=True)
class AttitudePenalty:
    """Squared angle, rad^2, between the base's final attitude and `goal`: |theta(T) - theta_des|^2 of Hu's eq. (9).

    Its factor alpha is 1/scale. The angle is that of the one rotation from one attitude to the other, at most 180
    degrees, where the smooth form is rounded off.
    """

    scale: Array
    goal: Quaternion
    name: str = field(default="attitude_penalty", metadata={"static": True})
    unit = "rad^2"

    def _error(self, motion: Motion) -> Quaternion:
        final = motion.base_quaternion[-1]
        return quaternion_multiply(quaternion_conjugate(final), jnp.asarray(self.goal))

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return jnp.sum(quaternion_to_rotation_vector(self._error(motion)) ** 2)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return jnp.sum(rounded_rotation_vector(self._error(motion), smoothing.peak) ** 2)


@register_dataclass
@dataclass(frozen=True)
class TorqueLimit:
    """Constraint: no joint's torque exceeds `limit` (n,), N m or N, infinite where there is none."""

    limit: Vector
    width: Array | float = 5e-4
    tolerance: Array | float = 1e-3
    name: str = field(default="torque_limit", metadata={"static": True})
    needs_torque = True

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None: (0,)."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """Peak/limit - 1 (n,), at most 0 when kept.

        The peak is a log-sum-exp of relative width `width`, never below the true one: what it lets pass is kept.
        """
        ratio = _torque(robot, motion) / self.limit
        return smooth_max(jnp.concatenate([ratio, -ratio]), self.width) - 1
