"""One capture: checked, sought until its constraints are kept, then made better level by level.

To be made better, an index is one more constraint: at most some level. Several levels below the one that is kept are
tried side by side, from the free numbers that keep it; the lowest that can be restored is kept, and the next ones lie
between it and the next lower, which could not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from jffsr.capture.batch import restore_many
from jffsr.capture.captures import CaptureSettings, CaptureTask, plan_captures, reviewed
from jffsr.capture.checks import check_capture
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import grasp_error
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.capture.terms import BaseDisturbance, IndexAtMost
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING
from jffsr.objectives.composite import CompositeIndex, TermValue
from jffsr.objectives.terms import Term
from jffsr.planning.problem import Problem
from jffsr.planning.result import ResultCode
from jffsr.planning.verification import Verification
from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.target.prediction import GraspPrediction
from jffsr.types import Array

LEVELS = 8
"""Tried side by side."""


@dataclass(frozen=True)
class CapturePlan:
    """A capture on the host; where there is no plan, all but `result` is None.

    free (k,), the free numbers of `problem`; motion; verification, of the independent re-run; terms of the index by
    name; error (12,), pose and velocity of the tool less the grasp frame's, m, rad, m/s, rad/s; duration, s;
    before, the index of the plan that the search began to better.
    """

    result: CaptureResult
    problem: Problem | None = None
    free: np.ndarray | None = None
    motion: Motion | None = None
    verification: Verification | None = None
    terms: dict[str, TermValue] | None = None
    error: np.ndarray | None = None
    before: float | None = None

    @property
    def duration(self) -> float | None:
        """How long the motion lasts, s."""
        return None if self.motion is None else float(self.motion.time[-1])

    @property
    def cost(self) -> float | None:
        """The index."""
        return None if self.terms is None else float(sum(term.weighted for term in self.terms.values()))


def plan_capture(
    robot: Robot,
    path: GraspPath,
    initial_state: State,
    clearance: ClearanceModel | None = None,
    settings: CaptureSettings | None = None,
    *,
    terms: Sequence[Term] | None = None,
    improve: int = 3,
    geometry: Geometry | None = None,
    prediction: GraspPrediction | None = None,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = FLOATING,
) -> CapturePlan:
    """Plan the capture of a grasp frame by a robot at rest of its joints.

    A plan that keeps every constraint is sought from several grasp times and postures; `improve` rounds of levels then
    make the sum of `terms` small (the base's disturbance by default), and a better plan is taken only where the re-run
    says that it keeps the constraints too. geometry of the target and the prediction behind its motion are looked at
    beforehand. Raises InputError as `plan_captures`; what cannot be done is told by the result's code.
    """
    wrong = check_capture(robot, path, initial_state, clearance, geometry, prediction)
    if wrong is not None:
        return CapturePlan(wrong)
    settings = settings or CaptureSettings()
    found = plan_captures(
        robot,
        [CaptureTask(path, clearance)],
        initial_state,
        settings,
        end_effector=end_effector,
        momentum=momentum,
        base_mode=base_mode,
    )
    result = found.result(0)
    if not found.attempts[0]:
        return CapturePlan(result)
    objective = CompositeIndex(
        tuple(terms) if terms else (BaseDisturbance(np.asarray(1.0)),), accuracy=np.inf
    )
    problem, free = replace(found.problems[0], objective=objective), found.free[0]
    plan = _told(problem, free, result, settings, end_effector)
    if not result.success or not improve:
        return plan
    best = plan
    low, high = min(0.0, 2 * plan.cost), plan.cost
    for _ in range(improve):
        levels = np.linspace(low, high, LEVELS + 2)[1:-1]
        if high <= low:
            break
        limited = [_at_most(problem, level) for level in levels]
        starts = np.broadcast_to(best.free, (LEVELS, 1, len(free)))
        found = restore_many(limited, starts, lanes=LEVELS, most_steps=settings.most_steps)
        kept = np.flatnonzero(found.kept)
        low = levels[kept[0] - 1] if len(kept) and kept[0] else low if len(kept) else levels[-1]
        for number in kept:
            better = _told(problem, found.free[number], None, settings, end_effector)
            if better.result.success and better.cost < best.cost:
                best, high = better, better.cost
                break
    return replace(best, before=plan.cost)


def _at_most(problem: Problem, level: float) -> Problem:
    limit = IndexAtMost(problem.objective, np.asarray(level))
    return replace(problem, constraints=(*problem.constraints, limit))


def _told(
    problem: Problem,
    free: np.ndarray,
    result: CaptureResult | None,
    settings: CaptureSettings,
    end_effector: str | None,
) -> CapturePlan:
    """The plan of these free numbers, verified."""
    motion, verification, verdict = jax.tree.map(
        lambda x: x[0], reviewed([problem], free[None], settings.step_factor)
    )
    if result is None:
        kept = verdict == ResultCode.ACCURACY_MET
        code = CaptureCode.CAPTURED if kept else CaptureCode.NOT_VERIFIED
        result = explain_capture(code, problem, verification)
    terms, error = jax.device_get(_terms_and_error(problem, free, end_effector))
    return CapturePlan(result, problem, free, motion, verification, terms, error)


@program(static_argnums=2)
def _terms_and_error(problem: Problem, free: Array, end_effector: str | None):
    motion = problem.motion(free)
    path = next(c.path for c in problem.constraints if c.name == "grasp_match")
    return (
        problem.objective.breakdown(problem.robot, motion),
        grasp_error(problem.robot, motion, path, end_effector),
    )
