"""One capture: checked, sought until its constraints are kept, then made better by the augmented Lagrangian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import numpy as np

from jffsr.capture.captures import CaptureSettings, CaptureTask, plan_captures, reviewed
from jffsr.capture.checks import check_capture
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import grasp_error
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.capture.terms import BaseDisturbance
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING
from jffsr.objectives.composite import CompositeIndex, TermValue
from jffsr.objectives.terms import Term
from jffsr.optimizers.augmented import AugmentedLagrangian
from jffsr.optimizers.constraints import Feasible
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.interface import Population
from jffsr.planning.problem import Problem
from jffsr.planning.result import ResultCode
from jffsr.planning.verification import Verification
from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.target.prediction import GraspPrediction
from jffsr.types import Array


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
    improve: int = 200,
    geometry: Geometry | None = None,
    prediction: GraspPrediction | None = None,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = FLOATING,
) -> CapturePlan:
    """Plan the capture of a grasp frame by a robot at rest of its joints.

    A plan that keeps every constraint is sought from several grasp times and postures; `improve` gradients then make
    the sum of `terms` small (the base's disturbance by default), and the better plan is taken only where the re-run
    says that it keeps them too. geometry of the target and the prediction behind its motion are looked at beforehand.
    Raises InputError as `plan_captures`; what cannot be done is told by the result's code.
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
    descent = AugmentedLagrangian(GradientDescent(starts=1))
    better = run(
        [Phase("constrained", descent, Stop(iterations=float(improve)))],
        Feasible(problem),
        jax.random.key(0),
        population=Population(free[None], np.full(1, np.inf)),
    )
    improved = _told(problem, np.asarray(better.best_position), None, settings, end_effector)
    chosen = improved if improved.result.success and improved.cost < plan.cost else plan
    return replace(chosen, before=plan.cost)


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
