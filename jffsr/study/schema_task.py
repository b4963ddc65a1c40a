"""The sections `limits` and `task`: what the robot may do, and from where to where it goes."""

from __future__ import annotations

import math
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BeforeValidator, model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import conflict, either, expected, number, sequence, text

MAX_JOINTS = 100

Number = Annotated[float, number()]
Vector3 = Annotated[tuple[Number, ...], sequence("a list of 3 numbers", 3, 3)]


def _is_list(value: Any) -> bool:
    return isinstance(value, list | tuple)


def _unit_quaternion(value: tuple[float, ...]) -> tuple[float, ...]:
    norm = math.hypot(*value)
    if abs(norm - 1.0) > 1e-3:
        raise expected(f"a quaternion (w, x, y, z) of norm 1 within 0.001, not {norm:.6g},")
    # A second reading must give the same numbers, so that what is already a unit is left as it is.
    return value if abs(norm - 1.0) < 1e-14 else tuple(v / norm for v in value)


Quaternion = Annotated[
    tuple[Number, ...], sequence("a list of 4 numbers (w, x, y, z)", 4, 4), AfterValidator(_unit_quaternion)
]


def _ordered_pair(value: Any) -> Any:
    if not _is_list(value) or len(value) != 2:
        raise expected("a pair [low, high] for each joint")
    return value


def _increasing(value: tuple[float, float]) -> tuple[float, float]:
    if not value[0] < value[1]:
        raise expected("a pair [low, high] with low < high")
    return value


Pair = Annotated[tuple[Number, Number], BeforeValidator(_ordered_pair), AfterValidator(_increasing)]


def _per_joint(one: Any, each: Any, of: str) -> Any:
    """One for all joints, a list with one for each, or a mapping from some joints' names."""
    listed = Annotated[tuple[each, ...], sequence(f"a list of 1 to {MAX_JOINTS} {of}", 1, MAX_JOINTS)]
    several = either(listed, dict[str, each], lambda value: isinstance(value, dict))
    return either(one, several, lambda value: isinstance(value, dict) or _is_list(value))


Range = _per_joint(
    Annotated[
        float,
        number(
            gt=0,
            instead=" (x for [-x, x]), a list of one pair [low, high] per joint or {joint: [low, high], ...}",
        ),
    ],
    Pair,
    "pairs [low, high]",
)
Positive = Annotated[float, number(gt=0)]
Bound = _per_joint(
    Annotated[float, number(gt=0, instead=", a list with one per joint or {joint: number, ...}")],
    Positive,
    "numbers > 0",
)
Excursion = either(
    Annotated[float, number(gt=0, instead=", a list of 3 (one per axis) or null")],
    Annotated[tuple[Positive, ...], sequence("a list of 3 numbers > 0 (one per axis)", 3, 3)],
    _is_list,
)
Joints = Annotated[
    tuple[Number, ...], sequence(f"a list of 1 to {MAX_JOINTS} numbers (one per joint)", 1, MAX_JOINTS)
]


class MotionLimits(Section):
    """Limits of the joints that replace the robot's own; a limit that is not given is left as the robot has it.

    A mapping from joints' names replaces those joints' limits alone.
    """

    units: ClassVar = ("position", "rate", "acceleration")

    position_deg: Range | None = None
    position: Range | None = None
    rate_deg: Bound | None = None
    rate: Bound | None = None
    acceleration_deg: Bound | None = None
    acceleration: Bound | None = None

    @model_validator(mode="after")
    def _check(self) -> MotionLimits:
        self.check_units()
        return self

    @property
    def position_si(self) -> tuple | dict[str, tuple[float, float]] | None:
        """One (low, high) for all joints, one per joint, or some by name, rad or m; None: the robot's own."""
        value = self.si("position")
        return (-value, value) if isinstance(value, float) else value

    @property
    def rate_si(self) -> float | tuple[float, ...] | dict[str, float] | None:
        """One for all joints, one per joint, or some by name, rad/s or m/s; None: the robot's own."""
        return self.si("rate")

    @property
    def acceleration_si(self) -> float | tuple[float, ...] | dict[str, float] | None:
        """One for all joints, one per joint, or some by name, rad/s^2 or m/s^2; None: the robot's own."""
        return self.si("acceleration")

    @property
    def torque_si(self) -> float | tuple[float, ...] | None:
        """None: the robot's own."""
        return None


class Limits(MotionLimits):
    """Limits of joints, torques and base that replace the robot's own."""

    units: ClassVar = ("position", "rate", "acceleration", "base_excursion")

    torque: Bound | None = None  # N m or N
    base_excursion_deg: Excursion | None = None
    base_excursion: Excursion | None = None

    @property
    def torque_si(self) -> float | tuple[float, ...] | dict[str, float] | None:
        """One for all joints, one per joint, or some by name, N m or N; None: the robot's own."""
        return self.torque

    @property
    def base_excursion_si(self) -> tuple[float, float, float] | None:
        """Largest turn of the base about each axis over the whole motion, rad; None: no limit."""
        value = self.si("base_excursion")
        return (value,) * 3 if isinstance(value, float) else value


Seconds = Annotated[float, number(gt=0, le=1e6, unit="s")]


class FreeDuration(Section):
    """A duration that the planner chooses between two bounds, s."""

    min: Seconds
    max: Seconds

    @model_validator(mode="after")
    def _check(self) -> FreeDuration:
        if not self.min < self.max:
            raise conflict(f"min is {self.min:g} and max is {self.max:g}, min < max is expected")
        return self


Duration = either(
    Annotated[float, number(gt=0, le=1e6, unit="s", instead=" or {min: ..., max: ...}")],
    FreeDuration,
    lambda value: isinstance(value, dict | FreeDuration),
)


class Task(Section):
    """From where to where, in what time, and with what momentum."""

    units: ClassVar = ("start", "goal")

    start_deg: Joints | None = None
    start: Joints | None = None
    goal_deg: Joints | None = None
    goal: Joints | None = None
    duration: Duration
    linear_momentum: Vector3 = (0.0, 0.0, 0.0)  # N s
    angular_momentum: Vector3 = (0.0, 0.0, 0.0)  # N m s, about the system centre of mass
    base_position: Vector3 = (0.0, 0.0, 0.0)  # m
    base_quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)  # w, x, y, z
    goal_attitude: Quaternion | None = None
    end_effector: Annotated[str, text(r".{1,200}", "the name of an end effector or null")] | None = None

    @model_validator(mode="after")
    def _check(self) -> Task:
        self.check_units("start", "goal")
        return self

    @property
    def start_si(self) -> tuple[float, ...]:
        """Joint positions at the start, rad or m."""
        return self.si("start")

    @property
    def goal_si(self) -> tuple[float, ...]:
        """Joint positions at the goal, rad or m."""
        return self.si("goal")

    @property
    def duration_range(self) -> tuple[float, float]:
        """Least and greatest duration, s; equal when the duration is given."""
        if isinstance(self.duration, FreeDuration):
            return self.duration.min, self.duration.max
        return self.duration, self.duration

    @property
    def duration_is_free(self) -> bool:
        """Whether the planner chooses the duration."""
        return isinstance(self.duration, FreeDuration)

    @property
    def momentum(self) -> tuple[float, ...]:
        """(6,): linear (N s), then angular about the system centre of mass (N m s), in the inertial frame."""
        return self.linear_momentum + self.angular_momentum
