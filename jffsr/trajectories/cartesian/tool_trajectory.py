"""A path with its timing: what is asked of the tool at a time.

With a prime for d/ds, the twist is (p', w) ds/dt, w = 2 vec(q' q*), and its derivative is
(p'', 2 vec(q'' q*)) (ds/dt)^2 + (p', w) d2s/dt2: q' q'* is real and drops out. A quaternion and its opposite give the
same. The derivatives come from the path itself by automatic differentiation, so that any function is a path.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply
from jffsr.trajectories.cartesian.interface import Timing, ToolPath, ToolTarget
from jffsr.trajectories.cartesian.poses import checked_quaternion, checked_vector
from jffsr.trajectories.cartesian.timing import Uniform
from jffsr.trajectories.checks import checked_duration
from jffsr.types import Array, Quaternion, Scalar, Vector3

PoseFunction = Callable[[Scalar], tuple[Vector3, Quaternion]]


@register_dataclass
@dataclass(frozen=True, eq=False)
class ToolTrajectory:
    """A tool's path and its timing: pose, twist and acceleration at any time, exact to rounding.

    path: any callable of s in [0, 1] that gives position (3,), m, and quaternion (4,) in I; it must be traceable and,
    for the acceleration, smooth (twice differentiable). timing gives s and its derivatives. Raises InputError for a
    function whose result is no pose.
    """

    path: ToolPath
    timing: Timing

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", as_node(self.path, 1.0))

    @classmethod
    def from_callable(cls, pose_at: PoseFunction, duration: float) -> ToolTrajectory:
        """The trajectory of a function of time, s, in [0, duration] that gives position (3,), m, and quaternion."""
        duration = checked_duration(duration)
        return cls(_InTime(as_node(pose_at, float(duration)), duration), Uniform(duration))

    @property
    def duration(self) -> Array:
        """Duration, s."""
        return self.timing.duration

    def __call__(self, time: Scalar) -> ToolTarget:
        """What is asked of the tool at a time, s; before 0 and after the duration it rests at an end."""
        s, rate, acceleration = self.timing(jnp.asarray(time))
        (position, q), slope, bend = path_derivatives(self.path, s)
        return ToolTarget(position, q, slope * rate, bend * rate**2 + slope * acceleration)


def path_derivatives(path: ToolPath, s: Scalar) -> tuple[tuple[Vector3, Quaternion], Array, Array]:
    """Pose at s; the twist (6,), [linear; angular] in I, per unit of s; and the derivative of that by s (6,)."""

    def pose(s: Scalar) -> tuple[Vector3, Quaternion]:
        position, q = path(s)
        # Only the direction of a quaternion is an attitude.
        return position, q / jnp.sqrt(jnp.sum(q * q))

    def with_slope(s: Scalar) -> tuple[tuple[Vector3, Quaternion], tuple[Vector3, Quaternion]]:
        return jax.jvp(pose, (s,), (jnp.ones_like(s),))

    ((position, q), (velocity, q_rate)), (_, (bend, q_bend)) = jax.jvp(with_slope, (s,), (jnp.ones_like(s),))
    back = quaternion_conjugate(q)
    turning = [2 * quaternion_multiply(x, back)[1:] for x in (q_rate, q_bend)]
    return (position, q), jnp.concatenate([velocity, turning[0]]), jnp.concatenate([bend, turning[1]])


@register_dataclass
@dataclass(frozen=True)
class _Function:
    """A plain function as a pytree without numbers."""

    function: PoseFunction = field(metadata={"static": True})

    def __call__(self, x: Scalar) -> tuple[Vector3, Quaternion]:
        position, q = self.function(x)
        return jnp.asarray(position), jnp.asarray(q)


@register_dataclass
@dataclass(frozen=True, eq=False)
class _InTime:
    """A function of time as one of the share of the duration."""

    pose_at: PoseFunction
    duration: Array

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]:
        return self.pose_at(s * self.duration)


def as_node(function: PoseFunction, end: float) -> PoseFunction:
    """The callable itself if it is a pytree with numbers, else wrapped as one without, its ends checked."""
    if not callable(function) or not jax.tree_util.all_leaves([function]):
        return function
    wrapped = _Function(function)
    for place in (0.0, end):
        try:
            position, q = wrapped(jnp.asarray(place))
        except (TypeError, ValueError) as error:
            raise InputError(f"the path's function gives no pose at {place:g}: {error}") from error
        if not isinstance(position, jax.core.Tracer) and not isinstance(q, jax.core.Tracer):
            checked_vector(position.tolist(), 3, f"the path's position at {place:g}")
            checked_quaternion(q.tolist(), f"the path's quaternion at {place:g}")
    return wrapped
