"""Measures over outcomes: against their definition as a minimum, and the two ends of the scale."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from jffsr.objectives.risk import smooth_value_at_risk_mean, value_at_risk_mean

OUTCOMES = np.random.default_rng(5).normal(3.0, 2.0, 20)
plain = jax.jit(value_at_risk_mean)
smooth = jax.jit(jax.value_and_grad(smooth_value_at_risk_mean))


def by_definition(values: np.ndarray, level: float) -> float:
    """min over t of t + mean(max(0, values - t))/(1 - level), by a search."""

    def objective(t):
        return t + np.mean(np.maximum(0.0, values - t)) / (1 - level)

    # The minimum of a piecewise linear function is at one of its corners.
    return min(objective(t) for t in values)


@pytest.mark.parametrize("level", [0.0, 0.3, 0.5, 0.72, 0.9, 0.94])
def test_the_mean_of_the_worst_share_is_the_minimum_that_defines_it(level):
    np.testing.assert_allclose(plain(OUTCOMES, level), by_definition(OUTCOMES, level), rtol=1e-14)


def test_the_ends_are_the_mean_and_the_worst():
    np.testing.assert_allclose(plain(OUTCOMES, 0.0), OUTCOMES.mean(), rtol=1e-15)
    for level in (0.95, 0.99, 1.0):
        assert plain(OUTCOMES, level) == OUTCOMES.max()


def test_outcomes_that_are_not_finite_are_the_worst():
    broken = OUTCOMES.copy()
    broken[3] = np.nan
    assert plain(broken, 0.5) == np.inf
    assert plain(broken, 1.0) == np.inf


@pytest.mark.parametrize("level", [0.0, 0.5, 0.9, 1.0])
def test_the_rounded_measure_lies_above_the_plain_one_and_tends_to_it(level):
    exact, share = float(plain(OUTCOMES, level)), max(1 - level, 1 / len(OUTCOMES))
    for width in (0.5, 0.05, 1e-4):
        value = float(smooth(OUTCOMES, level, width)[0])
        assert -1e-12 <= value - exact <= width * np.log(2) / share + 1e-12


@pytest.mark.parametrize("level", [0.0, 0.5, 0.9, 1.0])
def test_its_gradient_is_a_probability_where_outcomes_are_equal_too(level):
    values = OUTCOMES.copy()
    values[:4] = values.max()
    _, gradient = smooth(values, level, 0.1)
    chex.assert_tree_all_finite(gradient)
    # A rise of all outcomes raises the measure by as much; none of them makes it fall.
    np.testing.assert_allclose(np.sum(gradient), 1.0, rtol=1e-12)
    assert np.all(np.asarray(gradient) >= 0)
    direction, step = np.random.default_rng(1).normal(size=20), 1e-3
    shifted = [float(smooth(values + k * step * direction, level, 0.1)[0]) for k in (-2, -1, 1, 2)]
    slope = np.dot([1 / 12, -2 / 3, 2 / 3, -1 / 12], shifted) / step
    np.testing.assert_allclose(gradient @ direction, slope, rtol=1e-7, atol=1e-9)


def test_the_edge_of_the_share_is_where_a_search_finds_it():
    width, share = 0.3, 0.4

    def objective(t):
        return t + np.mean(width * np.logaddexp(0, (OUTCOMES - t) / width)) / share

    found = minimize_scalar(objective, bracket=(0.0, 5.0), tol=1e-12)
    np.testing.assert_allclose(smooth(jnp.asarray(OUTCOMES), 1 - share, width)[0], found.fun, rtol=1e-12)
