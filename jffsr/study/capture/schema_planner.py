"""The sections `grasp_time`, `planner`, `objective`, `front`: when to grasp, how a motion is sought, what is good."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, either, flag, number, sequence, text, whole
from jffsr.study.schema_task import Number

Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]
Flag = Annotated[bool, flag()]
Seconds = Annotated[float, number(gt=0, le=1e5, unit="s")]
FREE, CRITERION = "free", "criterion"


def _increasing(value: tuple[float, ...]) -> tuple[float, ...]:
    if not 0 <= value[0] < value[1] <= 1e5:
        raise conflict(f"found {list(value)}, a pair [first, last] in s with 0 <= first < last is expected")
    return value


Window = Annotated[
    tuple[Number, ...], sequence("a pair [first, last] in s", 2, 2), AfterValidator(_increasing)
]
Time = either(
    Annotated[Literal["free", "criterion"], choice(FREE, CRITERION)],
    Annotated[float, number(gt=0, le=1e5, unit="s", instead=", 'free' or 'criterion'")],
    lambda value: not isinstance(value, str),
)


class GraspTime(Section):
    """When to grasp, s after the robot starts.

    time: `free`, the planner chooses within the window, beginning at the best times of the criterion; `criterion`, its
    least value decides; or a number. map: the file of a capability map for the criterion, with the least share that
    counts as near; confirm: a time of the criterion counts only where inverse kinematics with the moving base reaches.
    """

    window: Window = (15.0, 60.0)
    time: Time = FREE
    map: Annotated[str, text(r".{1,4000}", "a capability map's file or null")] | None = None
    least_share: Annotated[float, number(ge=0, le=1)] = 0.0
    confirm: Flag = True

    @model_validator(mode="after")
    def _check(self) -> GraspTime:
        first, last = self.window
        if self.time == FREE and first == 0:
            raise conflict("found a window from 0 on, a free time needs one that begins later", "window")
        if not isinstance(self.time, str) and not first <= self.time <= last:
            sentence = f"found {self.time:g}, a time within the window [{first:g}, {last:g}] is expected"
            raise conflict(sentence, "time")
        return self


class Planner(Section):
    """How a motion is sought; lengths in m."""

    units: ClassVar = ("cone_half_angle",)

    margin: NotNegative | None = 0.02  # between all bodies; null: they may pass through each other
    guard: NotNegative = 0.003  # kept in addition at the planner's samples, for what lies between them
    ignore: Annotated[
        tuple[Annotated[tuple[str, ...], sequence("a pair of body names", 2, 2)], ...],
        sequence("a list of pairs of bodies", 0, 1000),
    ] = ()  # that may touch; the target is 'target'
    cone: Flag = True  # the tool comes along the grasp frame's x axis
    cone_half_angle_deg: Annotated[float, number(gt=0, lt=90, unit="deg")] | None = None
    cone_half_angle: Annotated[float, number(gt=0, lt=1.5707, unit="rad")] | None = None
    tolerance: Positive = 1e-6  # of the match, m, rad, m/s and rad/s
    control_points: Annotated[int, whole(7, 40)] = 8
    num_steps: Annotated[int, whole(10, 10_000)] = 50
    times: Annotated[int, whole(1, 50)] = 4  # of the criterion, to begin from where the time is free
    apart: Seconds = 4.0  # of these times from each other
    starts: Annotated[int, whole(1, 1000)] = 6  # of inverse kinematics at each time
    largest_bow: NotNegative = 0.0  # rad or m, of the joints' ways to these postures; 0: straight
    postures: Annotated[int, whole(1, 50)] = 3  # of those found that are tried, nearest first
    deceleration: Positive = 0.01  # m/s^2 of the tool at the end of a start
    lanes: Annotated[int, whole(1, 1000)] = 16  # attempts at once
    most_steps: Annotated[int, whole(1, 10_000)] = 60  # of one attempt
    improve: Annotated[int, whole(0, 50)] = 3  # rounds in which the objective is made smaller

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        # Written out, so that a resolved configuration shows it in the unit that people read.
        if isinstance(value, dict) and all(
            value.get(key) is None for key in ("cone_half_angle", "cone_half_angle_deg")
        ):
            return {**value, "cone_half_angle_deg": 30.0}
        return value

    @model_validator(mode="after")
    def _check(self) -> Planner:
        self.check_units()
        if self.postures > self.starts:
            sentence = f"found {self.postures}, at most the number of starts ({self.starts}) is expected"
            raise conflict(sentence, "postures")
        return self


class BaseDisturbance(Section):
    """How far the base is from its start at the grasp: its way by position, 1/m, its turn (half angle's sine)."""

    enabled: Flag = True
    scale: Positive = 1.0
    position: NotNegative = 1.0
    attitude: NotNegative = 1.0


class LostManipulability(Section):
    """Minus a measure of manipulability at the grasp; wrench: force and torque in the grasp frame, for 'force'."""

    enabled: Flag = False
    scale: Positive = 1.0
    measure: Annotated[
        Literal["published", "force", "least_singular_value"],
        choice("published", "force", "least_singular_value"),
    ] = "force"
    wrench: Annotated[tuple[Number, ...], sequence("a list of 6 numbers", 6, 6)] = (1.0, 0, 0, 0, 0, 0)
    length: Positive = 1.0  # m, that counts as a radian

    @model_validator(mode="after")
    def _check(self) -> LostManipulability:
        if not any(self.wrench):
            raise conflict("found a wrench of zeros, one with a direction is expected", "wrench")
        return self


class ExecutionTime(Section):
    """How long the motion lasts, s, for a time that is free."""

    enabled: Flag = False
    scale: Positive = 1.0


class Objective(Section):
    """What is made small once every constraint is kept: the sum of the terms that are enabled."""

    base_disturbance: BaseDisturbance = BaseDisturbance()
    lost_manipulability: LostManipulability = LostManipulability()
    execution_time: ExecutionTime = ExecutionTime()

    @model_validator(mode="after")
    def _check(self) -> Objective:
        if not any(getattr(self, name).enabled for name in type(self).model_fields):
            raise conflict("no term is enabled, at least one is expected")
        return self


class Front(Section):
    """The front between the base's disturbance and lost manipulability, each as the section `objective` has it."""

    levels: Annotated[int, whole(2, 100)] = 8


class CaptureVerification(Section):
    """The finer re-run of a finished plan."""

    step_factor: Annotated[int, whole(2, 1000)] = 4
