"""The typed configuration of a tracking study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, Literal

from jffsr.reading.section import Section
from jffsr.reading.values import choice, flag, text, whole
from jffsr.study.robot_study import NAME, RobotStudy
from jffsr.study.schema_solver import Output
from jffsr.study.schema_start import Start
from jffsr.study.schema_task import MotionLimits
from jffsr.study.tracking.schema_path import Path, Timing
from jffsr.study.tracking.schema_tracker import Accuracy, Label, Tracker, TrackerChange, Tuning


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
    task: Start
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
