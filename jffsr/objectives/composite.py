"""The composite index: a weighted sum of named terms, Li 2022 eq. (43).

J = sum of value / scale over the terms that are switched on. J <= 1 reads "accuracy met". As printed, (43)
counts the base attitude twice, against its start and against a goal, and the two conflict unless the goal is
the start: so the goal term is there only when a goal attitude is given, and then the start term is off by
default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import (
    ROTATION_VECTOR,
    AttitudeChange,
    AttitudeExcursion,
    GoalAttitude,
    JointAcceleration,
    JointRate,
    Term,
    ToolPosition,
)
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.types import Scalar

DEFAULT_ATTITUDE_SCALE = np.deg2rad(0.1)


class TermValue(NamedTuple):
    """A term before weighting (in its own unit) and after (value / scale)."""

    value: Scalar
    weighted: Scalar


@register_dataclass
@dataclass(frozen=True)
class CompositeIndex:
    """The sum of weighted terms; their names must differ. `accuracy` is the J that counts as met."""

    terms: tuple[Term, ...]
    smoothing: Smoothing = field(default_factory=Smoothing)
    accuracy: float = 1.0

    @property
    def units(self) -> dict[str, str]:
        """The unit of each term's value by the term's name; an empty text where it says none."""
        return {term.name: getattr(term, "unit", "") for term in self.terms}

    @property
    def needs_torque(self) -> bool:
        """Whether some term reads the joint torques, which a motion then should carry."""
        return any(getattr(term, "needs_torque", False) for term in self.terms)

    def breakdown(self, robot: Robot, motion: Motion) -> dict[str, TermValue]:
        """Every term of the published index by name."""
        result = {}
        for term in self.terms:
            value = term.value(robot, motion)
            result[term.name] = TermValue(value, value / term.scale)
        return result

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published index J."""
        return _total(entry.weighted for entry in self.breakdown(robot, motion).values())

    def smooth(self, robot: Robot, motion: Motion, looseness: Scalar | float = 1.0) -> Scalar:
        """The smooth index, for gradients; looseness widens the rounding."""
        smoothing = self.smoothing.loosened(looseness)
        return _total(term.smooth(robot, motion, smoothing) / term.scale for term in self.terms)


def _total(parts) -> Scalar:
    return sum(parts, start=jnp.zeros(()))


def composite_index(
    robot: Robot,
    *,
    joint_goal: Sequence[float],
    initial_quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    goal_quaternion: Sequence[float] | None = None,
    excursion_limit: Sequence[float] | float | None = None,
    attitude_change: float | str | None = "default",
    joint_rate: float | None = 0.01,
    joint_acceleration: float | None = 0.01,
    attitude_excursion: float | None = 0.01,
    goal_attitude: float | None = 1e-3,
    tool_position: float | None = None,
    measure: str = ROTATION_VECTOR,
    end_effector: str | None = None,
    smoothing: Smoothing | None = None,
    accuracy: float = 1.0,
    extra: Sequence[Term] = (),
) -> CompositeIndex:
    """The composite index of system 1 with the scale k of each term, None switching it off.

    attitude_change is in rad (by default 0.1 degrees, and off when a goal_quaternion is given),
    tool_position in m, the others have no unit; limits of rate and acceleration are the robot's;
    excursion_limit, rad, is one number or three, one an axis, and None leaves that term out.
    """
    terms: list[Term] = []
    if attitude_change == "default":
        attitude_change = None if goal_quaternion is not None else DEFAULT_ATTITUDE_SCALE
    if attitude_change is not None:
        terms.append(AttitudeChange(np.asarray(attitude_change), measure))
    if joint_rate is not None:
        terms.append(JointRate(np.asarray(joint_rate), robot.limits.velocity))
    if joint_acceleration is not None:
        terms.append(JointAcceleration(np.asarray(joint_acceleration), robot.limits.acceleration))
    if attitude_excursion is not None and excursion_limit is not None:
        limit = np.broadcast_to(np.asarray(excursion_limit, dtype=float), (3,)).copy()
        terms.append(AttitudeExcursion(np.asarray(attitude_excursion), limit, measure))
    if goal_attitude is not None and goal_quaternion is not None:
        terms.append(GoalAttitude(np.asarray(goal_attitude), np.asarray(goal_quaternion, dtype=float)))
    if tool_position is not None:
        desired = initial_quaternion if goal_quaternion is None else goal_quaternion
        robot.end_effector_index(end_effector)
        terms.append(
            ToolPosition(
                np.asarray(tool_position),
                np.asarray(joint_goal, dtype=float),
                np.asarray(desired, dtype=float),
                end_effector,
            )
        )
    terms.extend(extra)
    if not terms:
        raise InputError("every term of the objective is switched off; at least one must be on")
    names = [term.name for term in terms]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two terms of the objective are named '{twice}'; names must differ")
    return CompositeIndex(tuple(terms), smoothing or Smoothing(), accuracy)
