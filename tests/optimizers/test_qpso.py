"""The swarm on shifted functions, over seeds, inside its bounds, with an exact count of evaluations."""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from shifted_functions import DIMENSIONS, LOWER, UPPER, rastrigin, sphere

from jffsr.errors import InputError
from jffsr.optimizers.interface import FunctionProblem, Population
from jffsr.optimizers.minimize import minimize
from jffsr.optimizers.qpso import QPSO
from jffsr.optimizers.registry import LARGEST_CONTRACTION, Settings, build_phases

PARTICLES, EVALUATIONS = 50, 20_000
GENERATIONS = EVALUATIONS // PARTICLES


@partial(jax.jit, static_argnums=2)
def whole_run(key, optimizer: QPSO, function):
    """Last state and the largest and smallest place of any particle in any generation."""
    problem = FunctionProblem(LOWER, UPPER, function)

    def step(state, _):
        state = optimizer.step(problem, state)
        return state, (jnp.min(state.position, axis=0), jnp.max(state.position, axis=0))

    state, (lowest, highest) = jax.lax.scan(step, optimizer.init(key, problem), length=GENERATIONS)
    return state, jnp.min(lowest, axis=0), jnp.max(highest, axis=0)


def seeds(count: int):
    return jax.random.split(jax.random.key(5), count)


OPTIMIZER = QPSO(iterations=float(GENERATIONS), particles=PARTICLES)


@pytest.mark.parametrize(("function", "threshold"), [(sphere, 1e-15), (rastrigin, 12.0)])
def test_median_over_seeds(function, threshold):
    state, lowest, highest = jax.vmap(whole_run, in_axes=(0, None, None))(seeds(5), OPTIMIZER, function)
    assert np.median(state.progress.best_value) < threshold
    assert np.all(np.asarray(state.progress.evaluations) == EVALUATIONS)
    assert np.all(lowest >= LOWER)
    assert np.all(highest <= UPPER)


def test_vmap_over_hyperparameters():
    """One compiled run for several coefficients; a swarm that contracts too early ends far worse."""
    optimizers = QPSO(
        iterations=jnp.full(3, float(GENERATIONS)),
        contraction_start=jnp.array([1.0, 0.3, 1.0]),
        contraction_end=jnp.array([0.5, 0.1, 0.5]),
        particles=PARTICLES,
    )
    key = seeds(5)[0]
    state = jax.vmap(whole_run, in_axes=(None, 0, None))(key, optimizers, sphere)[0]
    best = np.asarray(state.progress.best_value)
    assert best[0] == best[2] < 1e-10 < best[1]


def test_optimum_on_the_bounds_is_reached():
    outcome = minimize(lambda x: jnp.sum(x), ([-1.0, 2.0, -3.0], [4.0, 5.0, 6.0]), "qpso", 2000)
    np.testing.assert_array_equal(outcome.best_position, [-1.0, 2.0, -3.0])


def test_every_evaluation_is_counted():
    """A callback on the host sees each candidate that the objective is asked for."""
    seen = []

    def count(x):
        seen.append(np.array(x))
        return np.sum(x**2)

    def counted(x):
        return jax.pure_callback(count, jax.ShapeDtypeStruct((), x.dtype), x, vmap_method="sequential")

    settings = Settings(particles=5)
    outcome = minimize(counted, ([-1.0, -2.0], [3.0, 1.0]), "qpso", 23, settings=settings)
    # 23 pay for four generations of five.
    assert len(seen) == outcome.evaluations == 20
    assert outcome.gradient_evaluations == 0
    assert outcome.best_value == min(float(np.sum(x**2)) for x in seen)


def test_best_is_the_least_value_ever_seen_and_history_never_rises():
    outcome = minimize(rastrigin, (LOWER, UPPER), "qpso", 3000, key=3)
    best = [record.best_value for record in outcome.history]
    assert all(later <= earlier for earlier, later in pairwise(best))
    assert outcome.best_value == best[-1] == outcome.population.values.min()
    assert float(rastrigin(outcome.best_position)) == pytest.approx(outcome.best_value, rel=1e-12)
    assert [r.evaluations for r in outcome.history] == [50 * r.iteration for r in outcome.history]


def test_given_population_takes_the_first_places():
    given = Population(jnp.ones((3, DIMENSIONS)), jnp.full(3, jnp.inf))
    problem = FunctionProblem(LOWER, UPPER, sphere)
    state = QPSO(10.0, particles=6).init(jax.random.key(0), problem, given)
    np.testing.assert_array_equal(state.position[:3], given.positions)
    assert np.all(np.any(np.asarray(state.position[3:]) != 1.0, axis=1))


@pytest.mark.parametrize("contraction", [(1.0, 0.0), (-0.1, 0.5), (1.782, 0.5), (1.0, float("nan"))])
def test_contraction_must_let_the_swarm_contract(contraction):
    assert LARGEST_CONTRACTION == pytest.approx(1.781, abs=1e-3)
    with pytest.raises(InputError, match=r"must lie in \(0, 1.781\)"):
        build_phases("qpso", Settings(contraction=contraction))
    build_phases("qpso", Settings(contraction=(1.78, 0.5)))
