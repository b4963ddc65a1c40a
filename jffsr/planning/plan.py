"""A finished plan, and how a problem becomes one: search, then verify."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import ExitStack
from dataclasses import dataclass

import jax
import numpy as np

from jffsr.compiling import Program, program
from jffsr.errors import InputError
from jffsr.objectives.composite import TermValue
from jffsr.optimizers.ahead import prepare_run
from jffsr.optimizers.driver import Outcome, Record, Snapshot, run
from jffsr.optimizers.history import before_last_tenth
from jffsr.optimizers.registry import Settings
from jffsr.planning.codesign import CoDesign
from jffsr.planning.export import joint_table, to_csv, to_mat
from jffsr.planning.problem import Problem
from jffsr.planning.result import Result, Tolerances, explain, result_code, stands_still
from jffsr.planning.search import found_index, search_of
from jffsr.planning.sensitivity import Sensitivity, prepare_sensitivity, sensitivity
from jffsr.planning.stopwatch import Stopwatch
from jffsr.planning.verification import Verification, verify
from jffsr.rollouts.motion import Motion
from jffsr.trajectories.interface import PlannedTrajectory


@dataclass(frozen=True)
class Plan:
    """A verified plan, all numbers on the host.

    cost and terms are the published index of the motion at the planner's own step; verification has them
    again at the finer one, by which `result` judges. free holds the chosen free numbers (k,). evaluations and
    gradient_evaluations are counted apart; history has one record an iteration, or of a long search those that bettered
    the index, its values merits where there are constraints (`jffsr.optimizers.constraints.split`); seconds: compile,
    run, total.
    sensitivity holds the derivatives by the robot's masses and inertias, None where they were not asked for.
    """

    problem: Problem
    result: Result
    cost: float
    terms: dict[str, TermValue]
    free: np.ndarray
    trajectory: PlannedTrajectory
    motion: Motion
    verification: Verification
    evaluations: int
    gradient_evaluations: int
    history: tuple[Record, ...]
    reason: str
    seconds: dict[str, float]
    sensitivity: Sensitivity | None = None

    def first_at(self, value: float) -> Record | None:
        """The first record of the history whose best value is at most `value`."""
        return next((record for record in self.history if record.best_value <= value), None)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the motion as CSV; see `jffsr.planning.export.to_csv`."""
        to_csv(self.problem.robot, self.motion, path)

    def to_mat(self, path: str | os.PathLike[str]) -> None:
        """Write the motion for MATLAB or Octave; see `jffsr.planning.export.to_mat`."""
        to_mat(self.problem.robot, self.motion, self.cost, path)

    def joint_table(self, period: float) -> dict[str, np.ndarray]:
        """Joint motion every `period` s; see `jffsr.planning.export.joint_table`."""
        return joint_table(self.trajectory, float(self.motion.time[-1]), period)


class SearchInterrupted(Exception):
    """A search was stopped from outside before its end; `outcome` is what it had found."""

    def __init__(self, outcome: Outcome):
        super().__init__("the search was interrupted")
        self.outcome = outcome


@program(static_argnums=2, once=True)
def _verified(problem: Problem, candidate, step_factor: int):
    motion, verification = verify(problem, candidate, step_factor)
    terms = problem.objective.breakdown(problem.robot, motion)
    return motion, terms, verification, problem.trajectory.with_free(candidate)


_judged = Program(result_code, static_argnums=3, once=True)


def solve(
    problem: Problem | CoDesign,
    optimizer: str = "hybrid",
    settings: Settings | None = None,
    *,
    seed: int = 0,
    chunk: int = 10,
    step_factor: int = 4,
    precision: str = "float64",
    with_sensitivity: bool = True,
    tolerances: Tolerances | None = None,
    resume: Snapshot | None = None,
    on_chunk: Callable[[Snapshot], None] | None = None,
    interrupted: Callable[[], bool] = lambda: False,
) -> Plan:
    """Search with a registered optimizer, verify what it found, and say what became of it.

    The arguments are those of the driver, and step_factor and tolerances of the verification, which is in
    float64 also where precision is float32; with_sensitivity adds the derivatives by masses and inertias, one
    more compiled program. Of a CoDesign the plan is that of the robot chosen, `plan.problem.robot`.
    Raises SearchInterrupted where `interrupted` said so, and InputError with 64-bit floats off, unless precision is
    float32.
    """
    tolerances = tolerances or Tolerances()
    settings = settings or Settings()
    check_precision(precision)
    (phases, searched), key = search_of(problem, optimizer, settings), jax.random.key(seed)
    with Stopwatch() as watch, ExitStack() as at_end:
        ahead = prepare_run(phases, searched, key, chunk=chunk, resume=resume)
        planned = problem.problem if isinstance(problem, CoDesign) else problem
        ahead += _prepare_review(planned, step_factor, with_sensitivity)
        for future in ahead:
            at_end.callback(future.cancel)
        outcome = run(
            phases, searched, key, chunk=chunk, resume=resume, on_chunk=on_chunk, interrupted=interrupted
        )
        if outcome.interrupted:
            raise SearchInterrupted(outcome)
        with jax.enable_x64(True):
            free = np.asarray(outcome.best_position, dtype=float)
            if isinstance(problem, CoDesign):
                problem, free = jax.device_get(_chosen(problem, free))
            verified = _verified(problem, free, step_factor)
            code = _judged(problem, verified[2], np.array(_at_its_end(outcome)), tolerances)
            motion, terms, verification, trajectory = jax.device_get(verified)
            derivatives = sensitivity(problem, free) if with_sensitivity else None
    result = explain(int(code), problem, verification, tolerances, motion)
    return Plan(
        problem=problem,
        result=result,
        cost=_cost(problem, outcome, terms, verification),
        terms=terms,
        free=free,
        trajectory=trajectory,
        motion=motion,
        verification=verification,
        evaluations=outcome.evaluations,
        gradient_evaluations=outcome.gradient_evaluations,
        history=outcome.history,
        reason=outcome.reason,
        seconds=watch.as_dict(),
        sensitivity=derivatives,
    )


def _cost(
    problem: Problem, outcome: Outcome, terms: dict[str, TermValue], verification: Verification
) -> float:
    if not np.isfinite(outcome.best_value):
        return outcome.best_value
    nominal = sum(float(term.weighted) for term in terms.values())
    return float(found_index(problem, outcome.best_value, nominal, verification.measure))


@jax.jit
def _chosen(together: CoDesign, candidate: np.ndarray):
    return together.split(candidate)


@jax.jit
def _bounds(problem: Problem):
    return problem.bounds()


def _prepare_review(problem: Problem, step_factor: int, with_sensitivity: bool) -> list[Future]:
    """Begin to compile, in threads, what follows the search."""
    with jax.enable_x64(True):
        free = jax.ShapeDtypeStruct(_bounds.eval_shape(problem)[0].shape, float)
        prepared = [_verified.prepare(problem, free, step_factor)]
        if with_sensitivity:
            prepared.append(prepare_sensitivity(problem, free))
    return [future for future in prepared if future is not None]


def _at_its_end(outcome: Outcome) -> bool:
    """Whether the search had stopped improving, by its own word or by its last steps."""
    if outcome.reason in ("converged", "target"):
        return True
    earlier = before_last_tenth(outcome.history)
    return earlier is not None and bool(stands_still(earlier, outcome.history[-1].best_value))


def check_precision(precision: str) -> None:
    """Refuse to plan in float64 while JAX's 64-bit floats are off."""
    if precision == "float64" and not jax.config.jax_enable_x64:
        raise InputError(
            "planning needs float64: call jax.config.update('jax_enable_x64', True) first "
            "(or ask for precision: float32)"
        )
