"""The typed configuration of a capture study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from jffsr.reading.did_you_mean import hint, listed
from jffsr.reading.values import choice, conflict, text, whole
from jffsr.study.capture.schema_observation import Observation
from jffsr.study.capture.schema_planner import CaptureVerification, Front, GraspTime, Objective, Planner
from jffsr.study.capture.schema_target import GraspName, Target
from jffsr.study.robot_study import NAME, RobotStudy
from jffsr.study.schema_solver import Output
from jffsr.study.schema_start import Start
from jffsr.study.schema_task import MotionLimits


class CaptureConfig(RobotStudy):
    """One capture study: a robot, where it starts, a tumbling target, when and how it is to be grasped."""

    kind: Annotated[Literal["capture"], choice("capture")]
    name: Annotated[str, text(NAME, "a name of at most 100 letters, digits, '_', '.' and '-'")]
    robot: Annotated[str, text(r".{1,4000}", "a name of the catalogue or a path to a robot's file")]
    limits: MotionLimits = MotionLimits()
    task: Start
    target: Target
    grasp: GraspName | None = None  # of the target's; null: the one that the criterion likes best
    grasp_time: GraspTime = GraspTime()
    planner: Planner = Planner(cone_half_angle_deg=30.0)
    objective: Objective = Objective()
    front: Front | None = None
    observation: Observation | None = None
    verification: CaptureVerification = CaptureVerification()
    output: Output = Output()
    seed: Annotated[int, whole(0, 2**32 - 1)] = 0
    precision: Annotated[Literal["float64"], choice("float64")] = "float64"

    @model_validator(mode="after")
    def _check(self) -> CaptureConfig:
        names = self.target.grasps
        if self.grasp is not None and self.grasp not in names:
            known = listed(f"'{name}'" for name in names)
            raise conflict(f"found '{self.grasp}', {known} is expected{hint(self.grasp, names)}", "grasp")
        if self.planner.margin is not None and not self.target.has_solids:
            raise conflict(
                "found no shape that is kept clear of; give some, or set planner.margin to null",
                "target.shapes",
            )
        return self

    @property
    def grasps(self) -> tuple[str, ...]:
        """The grasp frames that may be chosen."""
        return tuple(self.target.grasps) if self.grasp is None else (self.grasp,)
