"""Sequential quadratic programming: published optima, multipliers' margins, bounds, points that are none."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from constrained_functions import G06, HS71

from jffsr.optimizers.constraints import ConstrainedFunctions, split
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.interface import Population
from jffsr.optimizers.sequential_quadratic import SequentialQuadratic

LIMIT = Stop(iterations=100)


def posed(published):
    return ConstrainedFunctions(
        published.lower,
        published.upper,
        1e-9,
        published.function,
        published.equality,
        published.inequality,
    )


def searched(problem, method, population=None, key=0):
    phases = [Phase("sequential", method, LIMIT)]
    return run(phases, problem, jax.random.key(key), population=population)


@pytest.mark.parametrize("published", [pytest.param(G06, marks=pytest.mark.slow), HS71], ids=["g06", "hs71"])
def test_the_best_start_finds_the_published_optimum(published):
    found = searched(posed(published), SequentialQuadratic(starts=6, inside=0.0, radius=0.1))
    value, missed = split(found.best_value)
    assert missed == 0
    np.testing.assert_allclose(value, published.value, rtol=2e-7)
    np.testing.assert_allclose(found.best_position, published.optimum, rtol=1e-3)
    # A derivative each step of each start, and no more than it takes.
    assert found.evaluations == 0
    assert found.gradient_evaluations <= 6 * 75


def test_inequalities_are_kept_with_the_margin_asked_for():
    """x least above 1: with the margin it ends there, and its value tells of it."""
    problem = ConstrainedFunctions(
        -3 * np.ones(2),
        3 * np.ones(2),
        1e-9,
        lambda x: x[0] + x[1] ** 2,
        None,
        lambda x: (1 - x[0])[None],
    )
    start = Population(np.array([[2.0, 1.5]]), np.full(1, np.inf))
    found = searched(problem, SequentialQuadratic(starts=1, inside=0.05), start)
    np.testing.assert_allclose(found.best_position, [1.05, 0.0], atol=1e-6)


def test_it_ends_where_the_constraints_are_kept_though_its_steps_are_spent():
    found = searched(posed(HS71), SequentialQuadratic(starts=6, steps=4.0, inside=0.0, radius=0.1))
    values, missed = split(found.population.values)
    assert np.all(missed == 0)
    assert np.all(np.isfinite(values))
    for point in found.population.positions:
        assert np.max(np.abs(HS71.equality(point))) <= 1e-9
        assert np.max(HS71.inequality(point)) <= 0


def test_a_number_without_width_stays_and_a_point_that_is_none_ends():
    problem = ConstrainedFunctions(
        np.array([-1.0, 0.5]),
        np.array([1.0, 0.5]),
        1e-9,
        lambda x: jnp.where(x[0] > 0.9, jnp.nan, (x[0] + x[1]) ** 2),
        None,
        lambda x: (x[0] - 0.2)[None],
    )
    starts = Population(np.array([[0.1, 0.5], [0.95, 0.5]]), np.array([np.inf, np.inf]))
    found = searched(problem, SequentialQuadratic(starts=2), starts)
    np.testing.assert_allclose(found.best_position, [-0.5, 0.5], atol=1e-5)
    assert found.reason == "converged"
    assert np.isinf(found.population.values[1])
