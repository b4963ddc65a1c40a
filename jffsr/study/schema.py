"""The typed configuration of a planning study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import ATTITUDE_HELD, FIXED
from jffsr.reading.values import choice, conflict, text, whole
from jffsr.study.robot_study import NAME, RobotStudy
from jffsr.study.schema_constraints import Constraints
from jffsr.study.schema_objective import EFFORTS, TERMS, Objective
from jffsr.study.schema_solver import Optimizer, Output, Robust, Rollout, Trajectory, Verification
from jffsr.study.schema_task import Limits, Task


class PlanningConfig(RobotStudy):
    """One planning study: plain values, validated; equal ones compare equal wherever they were written."""

    kind: Annotated[Literal["planning"], choice("planning")]
    name: Annotated[str, text(NAME, "a name of at most 100 letters, digits, '_', '.' and '-'")]
    robot: Annotated[str, text(r".{1,4000}", "a name of the catalogue or a path to a robot's file")]
    limits: Limits = Limits()
    task: Task
    trajectory: Trajectory = Trajectory()
    objective: Objective = Objective()
    constraints: Constraints = Constraints()
    rollout: Rollout = Rollout()
    robust: Robust = Robust()
    optimizer: Optimizer = Optimizer()
    verification: Verification = Verification()
    output: Output = Output()
    seed: Annotated[int, whole(0, 2**32 - 1)] = 0
    precision: Annotated[Literal["float64", "float32"], choice("float64", "float32")] = "float64"

    @model_validator(mode="after")
    def _check(self) -> PlanningConfig:
        if self.objective.goal_attitude.enabled and self.task.goal_attitude is None:
            key = "objective.goal_attitude.enabled"
            raise conflict("found true, but no 'task.goal_attitude' is given", key)
        if self.constraints.base_excursion is not None and self.limits.base_excursion_si is None:
            sentence = "given, but 'limits.base_excursion_deg' (or 'base_excursion', in rad) is not"
            raise conflict(sentence, "constraints.base_excursion")
        if not self.enabled_terms:
            sentence = "no term counts (an excursion only under a limit), at least one is expected"
            raise conflict(sentence, "objective")
        mode, task = self.rollout.base_mode, self.task
        lost = {ATTITUDE_HELD: ("angular",), FIXED: ("linear", "angular")}.get(mode, ())
        for key in (f"{kind}_momentum" for kind in lost):
            if any(getattr(task, key)):
                found = list(getattr(task, key))
                sentence = f"found {found}, rollout.base_mode '{mode}' does not keep it, leave it out"
                raise conflict(sentence, f"task.{key}")
        return self

    def term_enabled(self, name: str) -> bool:
        """Whether a built-in term counts, its null resolved; the excursion counts only under a limit."""
        enabled = getattr(self.objective, name).enabled
        if name == "attitude_change" and enabled is None:
            return self.task.goal_attitude is None
        if name == "goal_attitude" and enabled is None:
            return self.task.goal_attitude is not None
        if name == "joint_position" and enabled is None:
            return not self.trajectory.keeps_position
        if name == "joint_torque" and enabled is None:
            efforts = (getattr(self.objective, effort).enabled for effort in EFFORTS)
            return self.limits.torque is not None or any(efforts)
        if name == "attitude_excursion":
            return enabled and self.limits.base_excursion_si is not None
        return enabled

    @property
    def enabled_terms(self) -> tuple[str, ...]:
        """Names of all terms that count, built-in ones first, in the order of the results."""
        return (*filter(self.term_enabled, TERMS), *(term.label for term in self.objective.terms))
