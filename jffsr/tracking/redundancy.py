"""What the joints do with the freedom that the tool leaves them: tasks of lower priority, in its null space.

The first task gets the null space of the tool, the second what the first leaves (Nakamura 1991). A task with a
velocity of its own is solved for in that space, or solved for on its own and then projected, which gives up
accuracy for freedom from algorithmic singularities (Chiaverini 1997); the others are gradients that are climbed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import Kinematics, kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Limits, Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_rotation_vector
from jffsr.spatial.safe import safe_norm
from jffsr.tracking.damping import Damping, raised_cosine
from jffsr.tracking.free_base import Response
from jffsr.tracking.inverses import filtered_inverse, null_space
from jffsr.types import Array, Matrix, Twist, Vector

# A base that cannot turn has a map of zeros, which still needs some damping.
_LEAST_TURN = 1e-12


class Situation(NamedTuple):
    """What a secondary task may look at: the robot, its state and kinematics, and how base and tool respond."""

    robot: Robot
    state: State
    kin: Kinematics
    response: Response
    start: State
    momentum: Twist
    end_effector: str | None
    base_mode: str


class SecondaryTask(Protocol):
    """Adds to the joint rates (n,) inside a null space (n, n), and says what it leaves of that space."""

    def __call__(
        self, situation: Situation, rates: Vector, space: Matrix, damping: Damping
    ) -> tuple[Vector, Matrix]: ...


def range_share(limits: Limits, joint_position: Array) -> tuple[Array, Vector]:
    """Joint positions (..., n) as a share of the way from the middle of the range to its end, -1 and 1 being the ends,
    and half the ranges (n,); zero and 1 for joints without both limits."""
    lower, upper = jnp.asarray(limits.position_lower), jnp.asarray(limits.position_upper)
    bounded = jnp.isfinite(lower) & jnp.isfinite(upper)
    half = jnp.where(bounded, 0.5 * (upper - lower), 1.0)
    middle = jnp.where(bounded, 0.5 * (upper + lower), joint_position)
    return (joint_position - middle) / half, half


def limit_gradient(robot: Robot, joint_position: Vector) -> Vector:
    """Gradient (n,) of the mean of ((q - mid)/half range)^2/2 over the joints; zero for joints without limits."""
    share, half = range_share(robot.limits, joint_position)
    return share / (half * joint_position.size)


@register_dataclass
@dataclass(frozen=True)
class JointLimitAvoidance:
    """Joints drawn to the middle of their ranges: down the gradient of the mean of ((q - mid)/half range)^2/2.

    Liegeois 1977. gain, 1/s per unit of the half range squared; joints without limits are left alone.
    """

    gain: Array | float

    def __call__(
        self, situation: Situation, rates: Vector, space: Matrix, damping: Damping
    ) -> tuple[Vector, Matrix]:
        """The rates with the projected gradient added; the whole space is left."""
        return rates - self.gain * (
            space @ limit_gradient(situation.robot, situation.state.joint_position)
        ), space


@register_dataclass
@dataclass(frozen=True)
class ManipulabilityGradient:
    """Posture with more manipulability: rates gain times the gradient of log sqrt(det(J* J*' + width^2 1)).

    Yoshikawa 1985 with the logarithm, so that the gain, rad^2/s, does not depend on the size of the arm; the width,
    in the units of the singular values, keeps it finite at singularities.
    """

    gain: Array | float
    width: Array | float = 0.01

    def __call__(
        self, situation: Situation, rates: Vector, space: Matrix, damping: Damping
    ) -> tuple[Vector, Matrix]:
        """The rates with the projected gradient added; the whole space is left."""
        s = situation

        def log_manipulability(q: Vector) -> Array:
            state = State(s.state.base_position, s.state.base_quaternion, q)
            jacobian = generalized_jacobian(s.robot, kinematics(s.robot, state), s.end_effector, s.base_mode)
            inflated = jacobian @ jacobian.T + self.width**2 * jnp.eye(6)
            return jnp.sum(jnp.log(jnp.diagonal(jnp.linalg.cholesky(inflated))))

        return rates + self.gain * (space @ jax.grad(log_manipulability)(s.state.joint_position)), space


@register_dataclass
@dataclass(frozen=True)
class BaseAttitudeHeld:
    """The base's attitude kept at that of the start: a second task on the base's angular velocity.

    Nenchev, Umetani and Yoshida 1992.

    gain, 1/s, feeds back the rotation since the start; decoupled, static, solves for the base on its own and projects
    the rates afterwards (Chiaverini 1997). Directions in which the joints turn the base less than `share` of the
    most are damped: a heavy base turns little, so that the tool's damping would be out of scale.
    """

    gain: Array | float = 0.0
    share: Array | float = 0.02
    decoupled: bool = field(default=False, metadata={"static": True})

    def __call__(
        self, situation: Situation, rates: Vector, space: Matrix, damping: Damping
    ) -> tuple[Vector, Matrix]:
        """The rates with the base's task added, and what it leaves of the space."""
        s = situation
        turn, still = s.response.base_map[3:], s.response.base_drift[3:]
        since = quaternion_multiply(s.state.base_quaternion, quaternion_conjugate(s.start.base_quaternion))
        wanted = -self.gain * quaternion_to_rotation_vector(since) - still
        inside = turn @ space
        width = self.share * (safe_norm(turn.ravel()) + _LEAST_TURN)
        own = raised_cosine(width, width)
        if self.decoupled:
            added = space @ (filtered_inverse(turn, own) @ wanted)
        else:
            added = space @ (filtered_inverse(inside, own) @ (wanted - turn @ rates))
        return rates + added, space @ null_space(inside, own)
