"""What a motion has to keep, beside an index that it is to make small.

A constraint has a `name`, `equality(robot, motion)` (e,), zero when kept, and `inequality(robot, motion)` (i,), at
most zero when kept, both scaled so that 1 is a gross miss and differentiable everywhere; either may be empty. Its
`tolerance`, 1e-8 where it has none, is how far the motion may be off on the finer grid of the verification.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import jax.numpy as jnp
import numpy as np

from jffsr.objectives.terms import ROTATION_VECTOR, attitude_angles
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.spatial.safe import smooth_max
from jffsr.types import Array, Quaternion, Scalar


class Constraint(Protocol):
    """What a problem needs of a constraint."""

    name: str

    def equality(self, robot: Robot, motion: Motion) -> Array: ...

    def inequality(self, robot: Robot, motion: Motion) -> Array: ...


DEFAULT_TOLERANCE = 1e-8


def tolerance_of(constraint: Constraint) -> Array | float:
    """The constraint's own tolerance, else the default."""
    return getattr(constraint, "tolerance", DEFAULT_TOLERANCE)


def in_units(constraint: Constraint, amount: Array | float) -> tuple[float, str]:
    """An amount by which a constraint is missed, or may be, in its own unit, and that unit; empty for a ratio."""
    return float(amount) * getattr(constraint, "per", 1.0), getattr(constraint, "unit", "")


def largest_violation(constraint: Constraint, robot: Robot, motion: Motion) -> Scalar:
    """How far the worst of a constraint's equalities is off zero or of its inequalities above it, () >= 0."""
    amounts = jnp.concatenate(
        [jnp.abs(constraint.equality(robot, motion)), constraint.inequality(robot, motion)]
    )
    return jnp.max(amounts, initial=0.0)


@register_dataclass
@dataclass(frozen=True)
class FinalAttitude:
    """The base's attitude at the end is `goal` (4,), B to I: the rotation vector, rad, of the error is zero.

    On a planar robot two of its three numbers are zero whatever the joints do.
    """

    goal: Quaternion
    tolerance: Array | float = 1e-8
    name: str = field(default="final_attitude", metadata={"static": True})
    unit = "rad"

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """Rotation vector of goal^-1 q(T), (3,), rad."""
        goal = quaternion_conjugate(jnp.asarray(self.goal))
        return quaternion_to_rotation_vector(quaternion_multiply(goal, motion.base_quaternion[-1]))

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)


@register_dataclass
@dataclass(frozen=True)
class JointLimits:
    """Every joint keeps its limits at all times: relative overruns of the peaks of position, rate, acceleration.

    Arrays (n,), rad or m, s; None leaves a quantity out, infinite numbers single joints. A position's overrun is
    relative to half its range, which must be finite or infinite on both sides. Peaks are rounded off upwards over
    `width`, so that the limit is reached a little early, by width log(2 (2 N + 1)) at most.
    """

    position_lower: Array | None = None
    position_upper: Array | None = None
    velocity: Array | None = None
    acceleration: Array | None = None
    width: Array | float = 5e-4
    tolerance: Array | float = 1e-3
    name: str = field(default="joint_limits", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """One number a joint and quantity, position first."""
        grid, overruns = motion.joint_grid, [jnp.zeros(0)]
        if self.position_lower is not None:
            lower, upper = jnp.asarray(self.position_lower), jnp.asarray(self.position_upper)
            bounded = jnp.isfinite(upper - lower)
            middle = jnp.where(bounded, (lower + upper) / 2, 0.0)
            half = jnp.where(bounded, (upper - lower) / 2, jnp.inf)
            overruns.append(_overrun(grid.joint_position - middle, half, self.width))
        if self.velocity is not None:
            overruns.append(_overrun(grid.joint_velocity, jnp.asarray(self.velocity), self.width))
        if self.acceleration is not None:
            overruns.append(_overrun(grid.joint_acceleration, jnp.asarray(self.acceleration), self.width))
        return jnp.concatenate(overruns)


@register_dataclass
@dataclass(frozen=True)
class BaseExcursion:
    """The base's turn from its start stays within `limit` (3,), rad, about each axis at all times.

    Peaks are rounded off upwards over `width`, relative, as in JointLimits; measure is that of the index's terms.
    """

    limit: Array
    width: Array | float = 5e-4
    tolerance: Array | float = 1e-3
    measure: str = field(default=ROTATION_VECTOR, metadata={"static": True})
    name: str = field(default="base_excursion", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """Relative overrun of the peak about each axis, (3,)."""
        return _overrun(attitude_angles(motion, self.measure), jnp.asarray(self.limit), self.width)


def _overrun(values: Array, limit: Array, width: Array | float) -> Array:
    """The rounded peak of |values| (K, c) over limit (c,), less one."""
    ratio = values / limit
    return smooth_max(jnp.concatenate([ratio, -ratio]), width) - 1


def joint_limits(
    robot: Robot, quantities: Sequence[str] = ("position", "rate", "acceleration")
) -> JointLimits:
    """The constraint that keeps the robot's own limits of these quantities."""
    limits = robot.limits
    given: dict[str, np.ndarray] = {}
    if "position" in quantities:
        given |= {"position_lower": limits.position_lower, "position_upper": limits.position_upper}
    if "rate" in quantities:
        given["velocity"] = limits.velocity
    if "acceleration" in quantities:
        given["acceleration"] = limits.acceleration
    return JointLimits(**given)
