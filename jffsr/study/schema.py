"""The typed configuration of a planning study; every default is visible here and in the sections' files."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import PrivateAttr, model_validator

from jffsr.dynamics.base_mode import ATTITUDE_HELD, FIXED
from jffsr.errors import InputError
from jffsr.reading.section import Section
from jffsr.reading.sources import Sources
from jffsr.reading.values import choice, conflict, text, whole
from jffsr.study.schema_constraints import Constraints
from jffsr.study.schema_objective import EFFORTS, TERMS, Objective
from jffsr.study.schema_solver import Optimizer, Output, Robust, Rollout, Trajectory, Verification
from jffsr.study.schema_task import Limits, Task

NAME = r"(?!\.+\Z)[A-Za-z0-9_.-]{1,100}"  # also the name of a folder, so not . or ..


class PlanningConfig(Section):
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

    _sources: Sources = PrivateAttr(default_factory=Sources)

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

    def where(self, key: str) -> str:
        """Place and key for a message: `configs/x.yaml:12: task.goal_deg`; of a default, its section's."""
        return self._sources.where(key)

    def per_joint(self, quantity: str, num_joints: int) -> tuple | None:
        """The limit `position` ((low, high) each), `rate`, `acceleration` or `torque` of each joint; rad or m, s, N.

        None when not given. Raises InputError when a list is given whose length is not the number of joints.
        """
        value = getattr(self.limits, f"{quantity}_si")
        if value is None:
            return None
        if not isinstance(getattr(self.limits, self.limits.key_of(quantity)), tuple):
            return (value,) * num_joints
        if len(value) != num_joints:
            where = self.where(f"limits.{self.limits.key_of(quantity)}")
            raise InputError(f"{where}: found a list of {len(value)}, the robot has {num_joints} joints")
        return value
