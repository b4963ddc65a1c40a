"""The augmented Lagrangian: known optima and multipliers, counts, resumption, NaN."""

from __future__ import annotations

from dataclasses import dataclass, replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from constrained_functions import G06, G11, HS71
from shifted_functions import LOWER, OPTIMUM, UPPER

from jffsr.optimizers.augmented import AugmentedLagrangian, constrained_phases
from jffsr.optimizers.constraints import ConstrainedFunctions, Evaluation, Feasible, split
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.interface import Population
from jffsr.optimizers.minimize import minimize
from jffsr.optimizers.registry import Settings, build_phases

KEY = jax.random.key(7)
OPTIMIZER = AugmentedLagrangian(GradientDescent(starts=2, memory=5))

ONE_START = AugmentedLagrangian(GradientDescent(starts=1, memory=5))


def problem_of(case) -> Feasible:
    return Feasible(
        ConstrainedFunctions(case.lower, case.upper, 1e-10, case.function, case.equality, case.inequality)
    )


def near(case, spread=0.1) -> Population:
    """Two starts about the optimum, within the box, whose values are not known."""
    away = np.random.default_rng(3).normal(size=(2, case.optimum.size)) * spread
    points = np.clip(case.optimum + away * np.minimum(case.upper - case.lower, 10.0), case.lower, case.upper)
    return Population(jnp.asarray(points), jnp.full(2, jnp.inf))


def descended(case, optimizer=OPTIMIZER, steps=400, **keywords):
    """The outcome, and the state of the optimizer at its end."""
    seen = []
    keywords = {"chunk": 50, "population": near(case), **keywords}
    phase = Phase("constrained", optimizer, Stop(iterations=float(steps)))
    outcome = run([phase], problem_of(case), KEY, on_chunk=seen.append, **keywords)
    return outcome, seen


@pytest.fixture(scope="module")
def hs71():
    return descended(HS71)


def kkt_multipliers(case, x):
    """Least-squares multipliers of the active constraints at a point inside the box, and what they leave over."""
    jacobian = np.asarray(jax.jacfwd(case.inequality)(x))
    gradient = np.asarray(jax.grad(case.function)(x))
    found, *_ = np.linalg.lstsq(jacobian.T, -gradient, rcond=None)
    return found, gradient + jacobian.T @ found


def test_published_optimum_and_its_multipliers():
    outcome, seen = descended(G06)
    x, best = outcome.best_position, int(np.argmin(outcome.population.values))
    assert outcome.reason == "converged"
    assert outcome.best_value == pytest.approx(G06.value, rel=1e-8)
    np.testing.assert_allclose(x, G06.optimum, atol=1e-7)
    assert np.max(G06.inequality(x)) <= 0
    expected, left = kkt_multipliers(G06, jnp.asarray(x))
    np.testing.assert_allclose(left, 0.0, atol=1e-3)
    multipliers = seen[-1].state.multipliers
    np.testing.assert_allclose(multipliers.inequality[best], expected, rtol=1e-5)


def test_equality_inequality_and_bounds_at_once(hs71):
    outcome, _ = hs71
    x = outcome.best_position
    assert outcome.reason == "converged"
    assert abs(HS71.equality(x)[0]) <= 1e-10
    assert HS71.inequality(x)[0] <= 0
    assert outcome.best_value == pytest.approx(HS71.value, rel=1e-8)
    np.testing.assert_allclose(x, HS71.optimum, atol=2e-5)
    assert outcome.gradient_evaluations < 400
    assert outcome.evaluations == 0


def test_resumes_to_the_same_bits(hs71):
    outcome, seen = hs71
    again, _ = descended(HS71, resume=seen[0], population=None)
    chex.assert_trees_all_equal(vars(again), vars(outcome))


def test_best_by_merit_never_gets_worse(hs71):
    outcome, _ = hs71
    merits = np.array([record.best_value for record in outcome.history])
    assert np.all(np.diff(merits) <= 0)
    values, violations = split(merits)
    assert np.isinf(values[0])
    assert violations[0] > 1e-3
    assert violations[-1] == 0.0


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Quadratic:
    """|x - target|^2/2 under rows x = right, linear; NaN in the share of the box where x[0] is above `edge`."""

    target: jax.Array
    rows: jax.Array
    right: jax.Array
    edge: jax.Array

    def bounds(self):
        return jnp.asarray(LOWER[:4]), jnp.asarray(UPPER[:4])

    def evaluation(self, x, looseness=1.0):
        jax.debug.callback(lambda _: COUNT.append(1), x)
        value = jnp.where(x[0] > self.edge, jnp.nan, 0.5 * jnp.sum((x - self.target) ** 2))
        return Evaluation(value, value, self.rows @ x - self.right, jnp.zeros(0), 1e-10)


COUNT: list[int] = []


def quadratics(count):
    """Problems and their solutions by the linear system of Karush, Kuhn and Tucker."""
    rng = np.random.default_rng(11)
    rows = rng.normal(size=(count, 2, 4))
    inside = OPTIMUM[:4] + 0.3 * rng.normal(size=(count, 4))
    target = inside + 0.5 * rng.normal(size=(count, 4))
    right = np.einsum("kij,kj->ki", rows, inside)
    solutions = []
    for a, t, b in zip(rows, target, right, strict=True):
        matrix = np.block([[np.eye(4), a.T], [a, np.zeros((2, 2))]])
        solutions.append(np.linalg.solve(matrix, np.concatenate([t, b]))[:4])
    return Quadratic(target=target, rows=rows, right=right, edge=np.full(count, 1e3)), np.array(solutions)


def test_every_start_has_its_own_multipliers_and_nan_does_no_harm():
    """A batch of problems, two starts each, of which half begin where the objective is not finite."""
    problems, solutions = quadratics(3)
    problems = replace(problems, edge=solutions[:, 0] + 0.5)
    starts = solutions[:, None] + np.array([[1.0, 1.0, -0.5, 0.3], [-0.7, 0.2, 0.4, -0.3]])

    def solve(problem, starts):
        state = OPTIMIZER.init(KEY, Feasible(problem), Population(starts, jnp.full(2, jnp.inf)))

        def step(state, _):
            return OPTIMIZER.step(Feasible(problem), state), None

        state, _ = jax.lax.scan(step, state, length=160)
        return OPTIMIZER.population(state), state.progress

    population, progress = jax.jit(jax.vmap(solve))(problems, starts)
    assert np.all(progress.converged)
    for start in range(2):
        np.testing.assert_allclose(population.positions[:, start], solutions, atol=1e-7)
        missed = np.einsum("kij,kj->ki", problems.rows, population.positions[:, start]) - problems.right
        assert np.max(np.abs(missed)) <= 1e-10


def test_gradients_are_counted_as_they_are_taken():
    """With one start, every evaluation of the problem is one gradient that was charged."""
    problems, _ = quadratics(1)
    problem = Feasible(jax.tree.map(lambda x: x[0], problems))
    COUNT.clear()
    outcome = run([Phase("constrained", ONE_START, Stop(iterations=40.0))], problem, KEY)
    jax.effects_barrier()
    assert len(COUNT) == outcome.gradient_evaluations > 10


def test_constraints_that_contradict_each_other_end():
    """x0 = 1 and x0 = 2: the penalty passes its limit, and the best point is halfway."""
    rows, right = np.eye(4)[[0, 0]], np.array([1.0, 2.0])
    problem = Feasible(Quadratic(OPTIMUM[:4], rows, right, np.array(1e3)))
    outcome = run([Phase("constrained", ONE_START, Stop(iterations=600.0))], problem, KEY)
    assert outcome.reason == "converged"
    assert outcome.best_position[0] == pytest.approx(1.5, abs=1e-4)
    assert split(outcome.best_value)[1] == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_descents_become_one_constrained_phase():
    settings = Settings(gradient_iterations=60, polish_iterations=30, starts=3)
    swarm, constrained = constrained_phases(build_phases("hybrid", settings))
    assert swarm == build_phases("hybrid", settings)[0]
    assert (constrained.name, constrained.stop.iterations, constrained.optimizer.starts) == (
        "constrained",
        90.0,
        3,
    )
    assert constrained.optimizer.descent.looseness == settings.looseness
    (alone,) = constrained_phases(build_phases("gradient", settings))
    assert alone.stop.iterations == 90.0


def test_hybrid_finds_what_the_swarm_cannot():
    """The swarm stays in the corner where it met the line of the equality; the descent goes along it."""
    settings = Settings(particles=20, gradient_iterations=50, polish_iterations=30, memory=5)
    problem, bounds = {"equality": G11.equality, "tolerance": 1e-10}, (G11.lower, G11.upper)
    swarm = minimize(G11.function, bounds, "qpso", 200, settings=settings, **problem)
    assert swarm.best_value > 0.9
    found = minimize(G11.function, bounds, "hybrid", 200, settings=settings, **problem)
    assert found.violation == 0
    assert abs(G11.equality(found.best_position)[0]) <= 1e-10
    assert found.best_value == pytest.approx(G11.value, rel=1e-9)
    assert found.evaluations == 200
    assert found.gradient_evaluations <= 160
