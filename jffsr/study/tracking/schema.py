"""The typed configuration of a tracking study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import ATTITUDE_HELD, BASE_MODES, FIXED, FLOATING
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, text, whole
from jffsr.study.robot_study import NAME, RobotStudy
from jffsr.study.schema_solver import Output
from jffsr.study.schema_task import Joints, MotionLimits, Quaternion, Vector3
from jffsr.study.tracking.schema_path import Path, Timing
from jffsr.study.tracking.schema_tracker import Accuracy, Label, Tracker, TrackerChange, Tuning


class TrackingTask(Section):
    """Where the robot starts, and with what momentum."""

    units: ClassVar = ("start",)

    start_deg: Joints | None = None
    start: Joints | None = None
    linear_momentum: Vector3 = (0.0, 0.0, 0.0)  # N s
    angular_momentum: Vector3 = (0.0, 0.0, 0.0)  # N m s, about the system centre of mass
    base_position: Vector3 = (0.0, 0.0, 0.0)  # m
    base_quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)  # w, x, y, z
    base_mode: Annotated[Literal["floating", "attitude_held", "fixed"], choice(*BASE_MODES)] = FLOATING
    end_effector: Annotated[str, text(r".{1,200}", "the name of an end effector or null")] | None = None

    @model_validator(mode="after")
    def _check(self) -> TrackingTask:
        self.check_units("start")
        lost = {ATTITUDE_HELD: ("angular",), FIXED: ("linear", "angular")}.get(self.base_mode, ())
        for key in (f"{kind}_momentum" for kind in lost):
            if any(getattr(self, key)):
                found = list(getattr(self, key))
                raise conflict(
                    f"found {found}, base_mode '{self.base_mode}' does not keep it, leave it out", key
                )
        return self

    @property
    def momentum(self) -> tuple[float, ...]:
        """(6,): linear (N s), then angular about the system centre of mass (N m s), in the inertial frame."""
        return self.linear_momentum + self.angular_momentum


class TrackingVerification(Section):
    """The finer re-run of every tracked motion and the report of its singularities."""

    step_factor: Annotated[int, whole(2, 1000)] = 4
    singularities: Annotated[bool, flag()] = True


class TrackingConfig(RobotStudy):
    """One tracking study: one tracker, several to be compared, or one whose numbers are searched for."""

    kind: Annotated[Literal["tracking"], choice("tracking")]
    name: Annotated[str, text(NAME, "a name of at most 100 letters, digits, '_', '.' and '-'")]
    robot: Annotated[str, text(r".{1,4000}", "a name of the catalogue or a path to a robot's file")]
    limits: MotionLimits = MotionLimits()
    task: TrackingTask
    path: Path
    timing: Timing
    tracker: Tracker = Tracker()
    compare: dict[Label, TrackerChange] | None = None
    tuning: Tuning | None = None
    accuracy: Accuracy = Accuracy()
    verification: TrackingVerification = TrackingVerification()
    output: Output = Output()
    seed: Annotated[int, whole(0, 2**32 - 1)] = 0
    precision: Annotated[Literal["float64"], choice("float64")] = "float64"

    @property
    def trackers(self) -> dict[str, Tracker]:
        """All trackers by their labels: the study's own, or those to be compared."""
        if not self.compare:
            return {self.tracker.method: self.tracker}
        own = self.tracker.model_dump()
        return {label: Tracker(**{**own, **change.model_dump()}) for label, change in self.compare.items()}
