"""The published solver as a baseline: a particle swarm on the match alone, with repair and an archive.

Wang, Luo and Yu 2021, section 3.3: a swarm with adaptive inertia lowers Gamma_1 of eq. (25); candidates that break an
inequality are repaired; feasible ones are stored, and from these a choice is made by the base's disturbance, eq. (26),
and manipulability, eq. (27). What the paper leaves open was chosen so: the inertia follows the share of particles that
bettered themselves (`PSO`'s rule `success`); a candidate beyond a limit of rate or acceleration is repaired by drawing
that joint's control points towards its start until the limit is kept, which is exact, as a spline is linear in them,
and one beyond a position limit is cut there; approach cone and clearance, for which the paper names no repair, are
looked at when the archive is verified. The grasp time is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.captures import reviewed
from jffsr.capture.manipulability import PUBLISHED
from jffsr.capture.match import grasp_error
from jffsr.capture.terms import BaseDisturbance, LostManipulability
from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.objectives.constraints import tolerance_of
from jffsr.optimizers.hyperparameters import size
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.pareto import not_dominated
from jffsr.optimizers.population import PopulationState
from jffsr.optimizers.pso import PSO
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances
from jffsr.planning.verification import Verification
from jffsr.pytrees import register_dataclass
from jffsr.robots.stacking import first_unlike, stacked
from jffsr.types import Array, Scalar, Vector

TOLERANCE = np.repeat([0.01, np.deg2rad(2.0), 0.01, 0.01], 3)
"""Of the match, (12,): m, rad, m/s, rad/s."""

_ATTITUDE = 1 / np.sin(np.deg2rad(1.0))
_STORED = 2 * np.sqrt(6.0)
"""Gamma_1 above which one of the twelve errors is beyond its tolerance."""

_GENERATIONS_AT_ONCE = 20


@register_dataclass
@dataclass(frozen=True)
class MatchProblem:
    """A capture, of given duration, as the published fitness sees it: for a swarm."""

    problem: Problem

    def bounds(self) -> tuple[Vector, Vector]:
        """Those of the control points."""
        return self.problem.bounds()

    def repaired(self, candidate: Vector) -> Vector:
        """Control points within the limits of position, rate and acceleration, nearest the start along the way there.

        Each joint's are drawn towards its start by one factor; inside the limits the candidate stays as it is.
        """
        lower, upper = self.problem.bounds()
        law = self.problem.trajectory.with_free(jnp.clip(candidate, lower, upper))
        limits = self.problem.robot.limits
        times = jnp.linspace(0.0, 1.0, 4 * self.problem.num_steps + 1) * law.duration
        _, rate, second = law.on_grid(times)
        over = jnp.maximum(
            jnp.max(jnp.abs(rate), axis=1) / limits.velocity,
            jnp.max(jnp.abs(second), axis=1) / limits.acceleration,
        )
        return (law.start + (law.inner - law.start) / jnp.maximum(over, 1.0)).ravel()

    def value(self, candidate: Vector) -> Scalar:
        """Gamma_1 of eq. (25) of the repaired candidate, with the paper's weights."""
        motion = self.problem.motion(self.repaired(candidate))
        path, end_effector = _path(self.problem)
        return published_match(grasp_error(self.problem.robot, motion, path, end_effector))


def published_match(error: Vector) -> Scalar:
    """Gamma_1 of errors (12,): |Q_e dx| + |Q_v dv| with 100 per m, m/s and rad/s, and sin(angle/2) over sin(1 deg)."""
    position, turn, velocity = error[:3], error[3:6], error[6:]
    half = jnp.sin(jnp.linalg.norm(turn) / 2) * _ATTITUDE
    return jnp.sqrt(jnp.sum((100 * position) ** 2) + half**2) + 100 * jnp.linalg.norm(velocity)


@register_dataclass
@dataclass(frozen=True)
class RepairingSwarm(PSO):
    """The swarm whose particles are repaired where they land, and that stores the `archive` (static) best matches that
    may be within the tolerance."""

    archive: int = size(64, 1, 10**6)

    def begin(self, problem: OptimizationProblem, key: Array, position: Array):
        """Velocities, share of successes, and an empty archive."""
        empty = jnp.zeros((self.archive, position.shape[1])), jnp.full(self.archive, jnp.inf)
        return *super().begin(problem, key, position), *empty

    def keep(self, state: PopulationState, value: Array):
        """What the swarm keeps, and the archive with the new matches among it."""
        *_, stored, match = state.own
        kept, kept_value, moving = super().keep(replace(state, own=state.own[:2]), value)
        every = jnp.concatenate([match, jnp.where(value <= _STORED, value, jnp.inf)])
        order = jnp.argsort(every)[: self.archive]
        return kept, kept_value, (*moving, jnp.concatenate([stored, state.position])[order], every[order])

    def propose(self, problem: MatchProblem, key: Array, generation: Array, state: PopulationState):
        """Where the swarm goes, repaired."""
        position, moving = super().propose(problem, key, generation, replace(state, own=state.own[:2]))
        return jax.vmap(problem.repaired)(position), (*moving, *state.own[2:])


@dataclass(frozen=True)
class PublishedCaptures:
    """What the published solver found for one capture.

    match, the least Gamma_1; best (k,), its control points; free (m, k), the archive's members that are within the
    tolerance and whose re-run keeps every inequality; error (m, 12), disturbance (m,), and manipulability (m,), the
    published measure, of each; chosen, numbers of those of least disturbance, most manipulability and, nearest to the
    ideal point, the balanced one of what is not dominated; empty where nothing was stored. evaluations of Gamma_1.
    """

    match: float
    best: np.ndarray
    free: np.ndarray
    error: np.ndarray
    disturbance: np.ndarray
    manipulability: np.ndarray
    chosen: dict[str, int] = field(default_factory=dict)
    evaluations: int = 0


def published_solver(
    problems: Sequence[Problem],
    *,
    generations: int = 400,
    particles: int = 50,
    archive: int = 16,
    seed: int = 0,
    step_factor: int = 4,
) -> list[PublishedCaptures]:
    """Solve captures of given duration (`capture_problem` without duration_bounds) as published, all side by side.

    Raises InputError where durations are free or problems differ in more than numbers.
    """
    problems = list(problems)
    other = first_unlike(problems)
    if other is not None:
        raise InputError(f"problem {other} differs from problem 0 in more than numbers; solve it apart")
    if any(problem.trajectory.duration_bounds is not None for problem in problems):
        raise InputError("the published solver has its grasp time given; leave duration_bounds out")
    swarm = RepairingSwarm(float(generations), particles=particles, rule="success", archive=archive)
    posed = stacked([MatchProblem(problem) for problem in problems])
    keys = jax.random.split(jax.random.key(seed), len(problems))
    with all_devices():
        states = _begin(posed, keys, swarm)
        for _ in range(-(-generations // _GENERATIONS_AT_ONCE)):
            states = _go_on(posed, states, swarm)
        progress, stored, match, error, values = jax.device_get(_looked_at(posed, states))
    near = np.isfinite(match) & np.all(np.abs(error) <= TOLERANCE, axis=-1)
    kept = np.zeros_like(near)
    if np.any(near):
        task, place = np.nonzero(near)
        _, verification, _ = reviewed([problems[k] for k in task], stored[task, place], step_factor)
        for row, (k, j) in enumerate(zip(task, place, strict=True)):
            one = jax.tree.map(lambda x, row=row: x[row], verification)
            kept[k, j] = keeps_inequalities(problems[k], one)
    return [
        _chosen(
            float(progress.best_value[k]),
            progress.best_position[k],
            stored[k][kept[k]],
            error[k][kept[k]],
            values[k][kept[k]],
            int(progress.evaluations[k]),
        )
        for k in range(len(problems))
    ]


def keeps_inequalities(
    problem: Problem, verification: Verification, tolerances: Tolerances | None = None
) -> bool:
    """Whether a re-run agrees with the plan and keeps every constraint but the match, whose tolerance is its own."""
    tolerances = tolerances or Tolerances()
    return bool(
        verification.attitude_difference <= tolerances.attitude
        and verification.momentum_drift <= tolerances.momentum
        and verification.boundary_error <= tolerances.boundary
        and all(
            verification.violations[c.name] <= np.max(tolerance_of(c))
            for c in problem.constraints
            if c.name != "grasp_match"
        )
    )


def _path(problem: Problem):
    match = next(c for c in problem.constraints if c.name == "grasp_match")
    return match.path, match.end_effector


def _chosen(match, best, free, error, values, evaluations) -> PublishedCaptures:
    disturbance, lost = values[:, 0], values[:, 1]
    chosen: dict[str, int] = {}
    if len(free):
        front = not_dominated(values)
        extent = np.ptp(values[front], axis=0)
        scaled = (values[front] - values[front].min(axis=0)) / np.where(extent > 0, extent, 1.0)
        chosen = {
            "least_base_disturbance": int(np.argmin(disturbance)),
            "least_lost_manipulability": int(np.argmin(lost)),
            "balanced": int(front[np.argmin(np.linalg.norm(scaled, axis=1))]),
        }
    return PublishedCaptures(match, best, free, error, disturbance, -lost, chosen, evaluations)


@program()
def _begin(problems: MatchProblem, keys: Array, swarm: RepairingSwarm) -> PopulationState:
    def one(item):
        problem, key = item
        state = swarm.init(key, problem)
        return replace(state, position=jax.vmap(problem.repaired)(state.position))

    return spread(one, (problems, keys), chunk=keys.shape[0], together=True)


@program()
def _go_on(problems: MatchProblem, states: PopulationState, swarm: RepairingSwarm) -> PopulationState:
    def one(item):
        problem, state = item
        return jax.lax.scan(lambda s, _: (swarm.step(problem, s), None), state, length=_GENERATIONS_AT_ONCE)[
            0
        ]

    return spread(one, (problems, states), chunk=1, together=True)


@program()
def _looked_at(problems: MatchProblem, states: PopulationState):
    """Progress, the archive and its matches, errors (K, a, 12), and disturbance and lost manipulability (K, a, 2)."""

    def one(item):
        posed, state = item
        *_, stored, match = state.own
        problem = posed.problem
        path, end_effector = _path(problem)
        terms = BaseDisturbance(), LostManipulability(path, measure=PUBLISHED, end_effector=end_effector)

        def member(free):
            motion = problem.motion(free)
            values = [term.value(problem.robot, motion) for term in terms]
            return grasp_error(problem.robot, motion, path, end_effector), jnp.stack(values)

        return state.progress, stored, match, *jax.vmap(member)(stored)

    return spread(one, (problems, states), chunk=1, together=True)
