"""The typed configuration of a reactionless study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import FLOATING
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, number, text, whole
from jffsr.study.capture.schema_target import Attitude, Inertia
from jffsr.study.reactionless.schema_hold import ControllerName, EstimatorName, Hold
from jffsr.study.robot_study import NAME, RobotStudy
from jffsr.study.schema_solver import Output
from jffsr.study.schema_start import Start
from jffsr.study.schema_task import MotionLimits, Vector3

Flag = Annotated[bool, flag()]
Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]
RunName = Annotated[str, text(r"[^\n]{1,60}", "a name of at most 60 letters")]


class Load(Attitude):
    """What the tool grasps, unknown to reference and controller: a free rigid body until then.

    inertia about its centre of mass, in the axes of its own frame; position of the centre of mass, m, and attitude in
    the tool's frame; velocity and angular velocity in I, before the grasp.
    """

    units: ClassVar = ("rotation_vector", "angular_velocity")

    mass: Positive  # kg
    inertia: Inertia  # kg m^2
    position: Vector3 = (0.0, 0.0, 0.0)
    velocity: Vector3 = (0.0, 0.0, 0.0)
    angular_velocity_deg: Vector3 | None = None
    angular_velocity: Vector3 | None = None

    @model_validator(mode="after")
    def _check(self) -> Load:
        self.check_units("angular_velocity")
        return self


class Pendulum(Section):
    """A block on a rope that strikes the tool: a moment about its z axis, or a force along its y axis as well."""

    units: ClassVar = ("release", "rebound", "incidence")

    time: Annotated[float, number(ge=0, unit="s")]
    mass: Positive = 5.0  # kg
    rope: Positive = 0.2  # m
    release_deg: Positive | None = None
    release: Positive | None = None
    rebound_deg: NotNegative | None = None
    rebound: NotNegative | None = None
    incidence_deg: NotNegative | None = None
    incidence: NotNegative | None = None
    contact: Positive = 0.01  # s
    arm: Positive = 0.1  # m
    with_force: Flag = False

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        if not isinstance(value, dict):
            return value
        given = dict(value)
        for key, degrees in (("release", 10.0), ("rebound", 3.8), ("incidence", 30.0)):
            if given.get(key) is None and given.get(f"{key}_deg") is None:
                given[f"{key}_deg"] = degrees
        return given

    @model_validator(mode="after")
    def _check(self) -> Pendulum:
        self.check_units()
        if not self.si("rebound") < self.si("release"):
            key = self.key_of("rebound")
            raise conflict(f"found {getattr(self, key):g}, less than the angle of release is expected", key)
        return self


class Variant(Section):
    """A run in which estimator or controller are others than `hold` says; null: those."""

    estimator: EstimatorName | None = None
    controller: ControllerName | None = None


class ReactionlessConfig(RobotStudy):
    """One reactionless study: a robot that has grasped what it does not know, and how it holds its base still."""

    kind: Annotated[Literal["reactionless"], choice("reactionless")]
    name: Annotated[str, text(NAME, "a name of at most 100 letters, digits, '_', '.' and '-'")]
    robot: Annotated[str, text(r".{1,4000}", "a name of the catalogue or a path to a robot's file")]
    limits: MotionLimits = MotionLimits()
    task: Start
    load: Load
    hold: Hold = Hold()
    runs: dict[RunName, Variant] | None = None  # that are compared; null: the one of `hold`
    seeds: Annotated[int, whole(1, 10_000)] = 1  # of noise and disturbance, of each run
    strike: Pendulum | None = None
    output: Output = Output()
    precision: Annotated[Literal["float64"], choice("float64")] = "float64"

    @model_validator(mode="after")
    def _check(self) -> ReactionlessConfig:
        if self.task.base_mode != FLOATING:
            raise conflict(
                f"found '{self.task.base_mode}', a base that is to be held by the arm floats",
                "task.base_mode",
            )
        if self.strike is not None and not self.strike.time < self.hold.duration:
            sentence = (
                f"found {self.strike.time:g} s, less than the hold's {self.hold.duration:g} s is expected"
            )
            raise conflict(sentence, "strike.time")
        return self

    @property
    def holds(self) -> dict[str, Hold]:
        """The section `hold` of every run, by its name."""
        if not self.runs:
            return {self.name: self.hold}
        return {
            name: self.hold.model_copy(
                update={key: value for key, value in variant.model_dump().items() if value is not None}
            )
            for name, variant in self.runs.items()
        }
