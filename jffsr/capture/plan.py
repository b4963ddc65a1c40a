"""One capture: checked, sought until its constraints are kept, then made better.

What is better moves more, and comes nearer to other bodies, than what was found first: so it is sought on a finer grid,
in several lanes that differ in how far inside the limits they stay, and the best that the re-run confirms is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from jffsr.capture.captures import CaptureSettings, CaptureTask, plan_captures, reviewed
from jffsr.capture.checks import check_capture
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.improve import improve_many
from jffsr.capture.match import grasp_error
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.capture.terms import BaseDisturbance
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING
from jffsr.objectives.composite import CompositeIndex, TermValue
from jffsr.objectives.terms import Term
from jffsr.optimizers.sequential_quadratic import SequentialQuadratic
from jffsr.planning.problem import Problem
from jffsr.planning.result import ResultCode
from jffsr.planning.verification import Verification
from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.target.prediction import GraspPrediction
from jffsr.types import Array

INSIDE = (1e-3, 0.03, 0.1, 0.2)
"""How far inside their limits the inequalities are driven, each in a lane of its own; 0.1 is 1 cm of clearance."""

ROUND = 40
"""Trials of each lane in a round."""

FINER = 2
"""Steps of the rollout on which a plan is made better, times those on which it was found."""


@dataclass(frozen=True)
class CapturePlan:
    """A capture on the host; where there is no plan, all but `result` is None.

    free (k,), the free numbers of `problem`; motion; verification, of the independent re-run; terms of the index by
    name; error (12,), pose and velocity of the tool less the grasp frame's, m, rad, m/s, rad/s; duration, s;
    before, the index of the plan that the search began to better; attempts, starts that were tried, and jacobians,
    derivatives of the constraints that were spent, by the bettering too.
    """

    result: CaptureResult
    problem: Problem | None = None
    free: np.ndarray | None = None
    motion: Motion | None = None
    verification: Verification | None = None
    terms: dict[str, TermValue] | None = None
    error: np.ndarray | None = None
    before: float | None = None
    attempts: int = 0
    jacobians: int = 0

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

    A plan that keeps every constraint is sought from several grasp times and postures; `improve` rounds of sequential
    quadratic programming then make the sum of `terms` small (the base's disturbance by default), and a better plan is
    taken only where the re-run says that it keeps the constraints too. geometry of the target and the prediction behind
    its motion are looked at beforehand. Raises InputError as `plan_captures`; what cannot be done is told by the
    result's code.
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
        tuple(terms) if terms else (BaseDisturbance(np.asarray(1.0)),), accuracy=np.asarray(np.inf)
    )
    problem = replace(found.problems[0], objective=objective)
    (plan,) = verified_plans([problem], found.free[:1], settings, end_effector)
    spent = int(found.jacobians[0])
    plan = replace(plan, result=result, attempts=int(found.attempts[0]), jacobians=spent)
    if not result.success or not improve:
        return plan
    finer = replace(problem, num_steps=FINER * problem.num_steps)
    methods = [SequentialQuadratic(steps=float(ROUND), inside=inside) for inside in INSIDE]
    best = plan
    for _ in range(improve):
        better = improve_many([finer] * len(INSIDE), np.tile(best.free, (len(INSIDE), 1)), methods)
        spent += int(np.sum(better.jacobians))
        tried = verified_plans([finer] * len(INSIDE), better.free, settings, end_effector)
        tried = [one for one in tried if one.result.success and one.cost < best.cost]
        if not tried:
            break
        best = min(tried, key=lambda one: one.cost)
    return replace(best, before=plan.cost, attempts=plan.attempts, jacobians=spent)


def verified_plans(
    problems: Sequence[Problem], free: np.ndarray, settings: CaptureSettings, end_effector: str | None = None
) -> list[CapturePlan]:
    """The plans of these free numbers (K, k), one of each problem, with what the re-run says of them."""
    motions, verifications, verdicts = reviewed(problems, free, settings.step_factor)
    plans = []
    for k, problem in enumerate(problems):
        motion, verification = jax.tree.map(lambda x, k=k: x[k], (motions, verifications))
        kept = verdicts[k] == ResultCode.ACCURACY_MET
        code = CaptureCode.CAPTURED if kept else CaptureCode.NOT_VERIFIED
        result = explain_capture(code, problem, verification)
        terms, error = jax.device_get(_terms_and_error(problem, free[k], end_effector))
        plans.append(CapturePlan(result, problem, free[k], motion, verification, terms, error))
    return plans


@program(static_argnums=2)
def _terms_and_error(problem: Problem, free: Array, end_effector: str | None):
    motion = problem.motion(free)
    path = next(c.path for c in problem.constraints if c.name == "grasp_match")
    return (
        problem.objective.breakdown(problem.robot, motion),
        grasp_error(problem.robot, motion, path, end_effector),
    )
