"""Recursive estimators against batch least squares; forgetting, its bounds, and lost samples."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.reactionless.estimation.forgetting import (
    ClockForgetting,
    ConstantForgetting,
    InnovationForgetting,
)
from jffsr.reactionless.estimation.least_squares import RecursiveLeastSquares, SlidingWindow

SIZE, VALUES, COUNT = 4, 2, 150
CLOCK = ClockForgetting()
BOUNDED = {
    "plain": RecursiveLeastSquares(),
    "clock": RecursiveLeastSquares(CLOCK),
    "innovation": RecursiveLeastSquares(InnovationForgetting(variance=1e-8)),
    "directional": RecursiveLeastSquares(CLOCK, directional=True),
    "window": SlidingWindow(20),
}


def samples(count: int = COUNT):
    rng = np.random.default_rng(1)
    regressors = rng.normal(size=(count, SIZE))
    truth = rng.normal(size=(SIZE, VALUES))
    return truth, regressors, regressors @ truth + 0.1 * rng.normal(size=(count, VALUES))


@jax.jit
def scanned(estimator, regressors, values, fresh):
    def step(known, sample):
        known = estimator.update(known, *sample)
        return known, (known.weights, jnp.trace(known.covariance))

    start = estimator.init(regressors.shape[1], values.shape[1])
    return jax.lax.scan(step, start, (regressors, values, fresh))


def run(estimator, regressors, values, fresh=None):
    """The last knowledge, and weights and trace after each sample."""
    fresh = np.ones(len(regressors), dtype=bool) if fresh is None else fresh
    return scanned(estimator, regressors, values, fresh)


def ridge(regressors, values, weights, variance=1.0):
    """Batch: the sum of w |y - W' phi|^2/variance, and |W|^2/Q(0), least."""
    information = (regressors * weights[:, None]).T @ regressors / variance
    return np.linalg.solve(
        information + np.eye(SIZE) / 1.4, (regressors * weights[:, None]).T @ values / variance
    )


def test_plain_is_the_batch_solution():
    truth, regressors, values = samples()
    known, _ = run(RecursiveLeastSquares(variance=0.01), regressors, values)
    expected = ridge(regressors, values, np.ones(COUNT), 0.01)
    np.testing.assert_allclose(known.weights, expected, atol=1e-12)
    np.testing.assert_allclose(known.weights, truth, atol=0.05)
    information = regressors.T @ regressors / 0.01 + np.eye(SIZE) / 1.4
    np.testing.assert_allclose(known.covariance, np.linalg.inv(information), atol=1e-14)


def test_the_published_forgetting_is_the_weighted_batch_solution():
    """Without a bound: samples count as much as all later factors leave of them, and so does Q(0)."""
    _, regressors, values = samples()
    estimator = RecursiveLeastSquares(CLOCK, largest=np.inf)
    known, _ = run(estimator, regressors, values)
    factors = 0.99 - 0.1 * np.exp(-0.04 * np.arange(COUNT))
    left = np.append(np.cumprod(factors[::-1])[::-1], 1.0)
    weights = left[1:]
    information = (regressors * weights[:, None]).T @ regressors + left[0] * np.eye(SIZE) / 1.4
    np.testing.assert_allclose(np.linalg.inv(known.covariance), information, rtol=1e-8, atol=1e-8)
    expected = np.linalg.solve(information, (regressors * weights[:, None]).T @ values)
    np.testing.assert_allclose(known.weights, expected, atol=1e-10)


def test_the_window_is_the_batch_solution_of_its_samples():
    """After enough repetition its pull towards the last estimate has no share left."""
    _, regressors, values = samples()
    window = SlidingWindow(20)
    repeated = np.concatenate([regressors, np.tile(regressors[-20:], (20, 1))])
    known, _ = run(window, repeated, np.concatenate([values, np.tile(values[-20:], (20, 1))]))
    expected = np.linalg.lstsq(regressors[-20:], values[-20:], rcond=None)[0]
    np.testing.assert_allclose(known.weights, expected, atol=1e-10)


def test_published_forgetting_winds_up():
    """A constant regressor: the trace grows as 1.4/prod(lambda) in each direction that nothing excites."""
    regressors = np.tile([1.0, 1.0, 1.0, 1.0], (3000, 1))
    estimator = RecursiveLeastSquares(CLOCK, largest=np.inf)
    _, (_, trace) = run(estimator, regressors, np.ones((3000, VALUES)))
    factors = 0.99 - 0.1 * np.exp(-0.04 * np.arange(3000))
    blown = 1.4 * (SIZE - 1) / np.cumprod(factors)
    assert np.all(np.asarray(trace)[[99, 999, 2999]] > 0.99 * blown[[99, 999, 2999]])
    assert float(trace[-1]) > 1e13
    directional, bounded = (
        run(estimator, regressors, np.ones((3000, VALUES)))[1][1]
        for estimator in (RecursiveLeastSquares(CLOCK, directional=True), RecursiveLeastSquares(CLOCK))
    )
    assert np.max(directional) < 1.4 * SIZE
    assert np.max(bounded) < 1.4 * SIZE


@pytest.mark.parametrize("name", list(BOUNDED))
def test_the_covariance_is_bounded_over_ten_thousand_steps(name):
    """A third of the time well excited, then one direction, then nothing at all but a value that jumps."""
    rng = np.random.default_rng(6)
    regressors = rng.normal(size=(10_000, SIZE))
    regressors[3_000:6_000] = [1.0, 0.5, -0.5, 2.0]
    regressors[6_000:9_000] = 0.0
    values = regressors @ rng.normal(size=(SIZE, VALUES))
    values[7_000:] += 3.0
    known, (weights, trace) = run(BOUNDED[name], regressors, values)
    bound = 1.4 * SIZE * (3.0 if name == "directional" else 1.0)
    assert np.max(trace) <= bound * (1 + 1e-9)
    assert np.all(np.isfinite(weights))
    assert np.linalg.eigvalsh(known.covariance)[0] > 0


def test_innovation_forgets_only_when_surprised():
    law = InnovationForgetting(variance=1e-4, memory=100.0)
    quiet = float(law(5, jnp.full(2, 1e-2), jnp.asarray(0.0)))
    np.testing.assert_allclose(quiet, 0.99, rtol=1e-12)
    assert float(law(5, jnp.zeros(2), jnp.asarray(0.0))) == 1.0
    assert float(law(5, jnp.full(2, 10.0), jnp.asarray(0.0))) == 0.8
    # What the covariance lets expect is no surprise.
    assert float(law(5, jnp.full(2, 1e-2), jnp.asarray(9.0))) > 0.998


def test_after_a_jump_those_that_forget_come_back():
    """Whoever forgets 0.01 a sample keeps e^-3 of the jump after 300; the direction alone, four times slower."""
    truth, regressors, _ = samples(600)
    signs = np.where(np.arange(600) < 300, 1.0, -1.0)
    values = signs[:, None] * (regressors @ truth)
    off = {}
    for name, estimator in {
        **BOUNDED,
        "innovation": RecursiveLeastSquares(InnovationForgetting(variance=1e-2)),
    }.items():
        known, _ = run(estimator, regressors, values)
        off[name] = float(np.abs(np.asarray(known.weights) + truth).max())
    assert off["plain"] > 1.0
    assert off["innovation"] < 0.02
    assert off["window"] < 1e-3
    assert off["clock"] < 0.15
    assert off["directional"] < 0.7 * off["plain"]


@pytest.mark.parametrize("name", list(BOUNDED))
def test_lost_samples_change_nothing(name):
    _, regressors, values = samples()
    fresh = np.ones(COUNT, dtype=bool)
    fresh[40:60] = False
    wrong, worse = regressors.copy(), values.copy()
    wrong[40:60] = 1e3
    # One that says it is fresh, and is not a number.
    wrong[80], worse[80] = np.nan, np.nan
    gone = ~fresh
    gone[80] = True
    known, _ = run(BOUNDED[name], wrong, worse, fresh)
    kept, _ = run(BOUNDED[name], regressors[~gone], values[~gone])
    np.testing.assert_allclose(known.weights, kept.weights, atol=1e-12)
    assert int(known.count) == COUNT - 21


def test_constant_forgetting_is_what_it_is_called():
    assert float(ConstantForgetting(0.97)(3, jnp.ones(2), jnp.ones(()))) == 0.97
