"""The terms of the composite index of Li 2022, section 4.1, each on its own.

A term has a `name`, a `scale` (the paper's k: the weighted term is value / scale), `value(robot, motion)`, the
published form, and `smooth(robot, motion, smoothing)`, which is differentiable everywhere and tends to it.
Its `unit`, where it has one, is that of its value; an overrun's is relative.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import jax.numpy as jnp

from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.objectives.smoothing import (
    Smoothing,
    error_norm,
    overrun,
    smooth_error_norm,
    smooth_overrun,
)
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_euler_zxy,
    quaternion_to_rotation_vector,
    rounded_rotation_vector,
)
from jffsr.spatial.safe import peak, smooth_hinge, smooth_max
from jffsr.types import Array, Quaternion, Scalar, Vector

ROTATION_VECTOR = "rotation_vector"
EULER_ZXY = "euler_zxy"


class Term(Protocol):
    """What the index needs of a term."""

    name: str
    scale: Array

    def value(self, robot: Robot, motion: Motion) -> Scalar: ...

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar: ...


def attitude_angles(motion: Motion, measure: str) -> Array:
    """Attitude angles (N + 1, 3), rad, of the base relative to its start.

    The rotation vector of R(0)' R(t), or, as the paper has it, angles about z, x and y of that rotation;
    the columns are about x, y, z either way.
    """
    relative = _relative_to_start(motion)
    if measure == EULER_ZXY:
        return quaternion_to_euler_zxy(relative)[..., jnp.array([1, 2, 0])]
    return quaternion_to_rotation_vector(relative)


def _relative_to_start(motion: Motion) -> Quaternion:
    q = motion.base_quaternion
    return quaternion_multiply(quaternion_conjugate(q[:1]), q)


def _smooth_attitude_angles(motion: Motion, measure: str, width: Scalar) -> Array:
    """The same but for a rotation vector rounded off at 180 degrees, where its length has a ridge."""
    if measure == EULER_ZXY:
        return attitude_angles(motion, measure)
    return rounded_rotation_vector(_relative_to_start(motion), width)


@register_dataclass
@dataclass(frozen=True)
class AttitudeChange:
    """Norm, rad, of the base's attitude change from start to end: |dPhi_s|, eq. (38)."""

    scale: Array
    measure: str = field(default=ROTATION_VECTOR, metadata={"static": True})
    name: str = field(default="attitude_change", metadata={"static": True})
    unit = "rad"

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return error_norm(attitude_angles(motion, self.measure)[-1])

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        width = smoothing.norm * self.scale
        angles = _smooth_attitude_angles(motion, self.measure, width / 2)
        return smooth_error_norm(angles[-1], self.scale, smoothing)


@register_dataclass
@dataclass(frozen=True)
class JointPosition:
    """Sum over joints of the overrun of [lower, upper], (n,) each, relative to half that range: eq. (39)'s form.

    Infinite where there is no limit; where only one end is, overruns of the other are in rad or m. For joint laws
    that do not keep position limits by themselves.
    """

    scale: Array
    lower: Array
    upper: Array
    name: str = field(default="joint_position", metadata={"static": True})
    unit = "relative"

    def _beyond(self, motion: Motion) -> Array:
        """How far (2, K, n) the motion is above the upper and below the lower limits, relative; -1 without one."""
        q, lower, upper = motion.joint_grid.joint_position, jnp.asarray(self.lower), jnp.asarray(self.upper)
        both = jnp.isfinite(lower) & jnp.isfinite(upper)
        half = jnp.where(both, (jnp.where(both, upper, 1.0) - jnp.where(both, lower, -1.0)) / 2, 1.0)
        above = jnp.where(jnp.isfinite(upper), (q - upper) / half, -1.0)
        below = jnp.where(jnp.isfinite(lower), (lower - q) / half, -1.0)
        return jnp.stack([above, below])

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The overrun of the peaks."""
        beyond = self._beyond(motion)
        return jnp.sum(jnp.maximum(0.0, peak(beyond.reshape(-1, beyond.shape[-1]))))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        beyond = self._beyond(motion)
        largest = smooth_max(beyond.reshape(-1, beyond.shape[-1]), smoothing.peak)
        return jnp.sum(smooth_hinge(largest, smoothing.overrun))


@register_dataclass
@dataclass(frozen=True)
class JointRate:
    """Sum over joints of the relative overrun of the peak rate over `limit` (n,), eq. (39)."""

    scale: Array
    limit: Array
    name: str = field(default="joint_rate", metadata={"static": True})
    unit = "relative"

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return overrun(motion.joint_grid.joint_velocity, self.limit)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return smooth_overrun(motion.joint_grid.joint_velocity, self.limit, smoothing)


@register_dataclass
@dataclass(frozen=True)
class JointAcceleration:
    """Sum over joints of the relative overrun of the peak acceleration over `limit` (n,), eq. (39)."""

    scale: Array
    limit: Array
    name: str = field(default="joint_acceleration", metadata={"static": True})
    unit = "relative"

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return overrun(motion.joint_grid.joint_acceleration, self.limit)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return smooth_overrun(motion.joint_grid.joint_acceleration, self.limit, smoothing)


@register_dataclass
@dataclass(frozen=True)
class AttitudeExcursion:
    """Sum over axes of the relative overrun of the base's peak attitude angle over `limit` (3,), eq. (41)."""

    scale: Array
    limit: Array
    measure: str = field(default=ROTATION_VECTOR, metadata={"static": True})
    name: str = field(default="attitude_excursion", metadata={"static": True})
    unit = "relative"

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return overrun(attitude_angles(motion, self.measure), self.limit)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        angles = _smooth_attitude_angles(motion, self.measure, smoothing.peak)
        return smooth_overrun(angles, self.limit, smoothing)


@register_dataclass
@dataclass(frozen=True)
class GoalAttitude:
    """Norm of the vector part of q_final^-1 q_goal, sin(angle/2): |dq|, eq. (42).

    Its gradient vanishes at 180 degrees from the goal, where this measure is stationary.
    """

    scale: Array
    goal: Quaternion
    name: str = field(default="goal_attitude", metadata={"static": True})

    def _error(self, motion: Motion) -> Array:
        final = motion.base_quaternion[-1]
        return quaternion_multiply(quaternion_conjugate(final), jnp.asarray(self.goal))[1:]

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return error_norm(self._error(motion))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return smooth_error_norm(self._error(motion), self.scale, smoothing)


@register_dataclass
@dataclass(frozen=True)
class ToolPosition:
    """Distance, m, of the tool at the end from its goal: |dp_e|, eq. (42).

    The goal is the tool's position at the joint goal (n,) with the base at the desired attitude and the
    system centre of mass where it is.
    """

    scale: Array
    joint_goal: Vector
    attitude: Quaternion
    end_effector: str | None = field(default=None, metadata={"static": True})
    name: str = field(default="tool_position", metadata={"static": True})
    unit = "m"

    def _error(self, robot: Robot, motion: Motion) -> Array:
        from_com = []
        for quaternion, joints in (
            (motion.base_quaternion[-1], motion.joint_position[-1]),
            (jnp.asarray(self.attitude), jnp.asarray(self.joint_goal)),
        ):
            kin = kinematics(robot, State(jnp.zeros(3), quaternion, joints))
            position, _ = end_effector_pose(robot, kin, self.end_effector)
            from_com.append(position - system_com(robot, kin))
        # Both tools hang on the same centre of mass, so its place drops out.
        return from_com[0] - from_com[1]

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return error_norm(self._error(robot, motion))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The smooth form."""
        return smooth_error_norm(self._error(robot, motion), self.scale, smoothing)


@register_dataclass
@dataclass(frozen=True)
class UserTerm:
    """A user's own `function(robot, motion) -> scalar`, taken as it is in both forms."""

    scale: Array
    function: Callable[[Robot, Motion], Scalar] = field(metadata={"static": True})
    name: str = field(metadata={"static": True})

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The user's value."""
        return jnp.asarray(self.function(robot, motion))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The user's value: smoothness is the user's."""
        return self.value(robot, motion)
