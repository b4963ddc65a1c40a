"""Tuning the numbers of a tracker by a genetic algorithm and by gradients, over the whole path."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.optimizers.driver import run
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.tracking.indices import PathError, PublishedIndex, peak_rate
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tuning import tuning

BOUNDS = {"lambda_max": (1e-3, 0.3), "epsilon": (1e-2, 0.3)}
# Coarser than the published sampling, which the tests need not repeat.
COARSE = Tracker(period=1.0, integration_steps=2)
LIMIT = np.deg2rad(6.0)


@pytest.fixture(scope="module")
def problem(robots):
    wu = robots["wu_2018_6dof"]
    path = wu_path.wu_path(wu, 25.0)
    return tuning(wu, path, wu_path.state_at(wu_path.START), COARSE, PathError(LIMIT), BOUNDS)


@pytest.fixture(scope="module")
def value(problem):
    return jit(lambda p, x: (p.value(x), peak_rate(p.tracked(x))))


def test_candidates_are_logarithms_of_positive_numbers(problem):
    lower, upper = problem.bounds()
    tuned = problem.tuned(jnp.asarray(upper))
    np.testing.assert_allclose([float(tuned.lambda_max), float(tuned.epsilon)], [0.3, 0.3])
    assert problem.logarithmic == (True, True)
    assert np.all(lower < upper)


@pytest.mark.slow
def test_the_genetic_algorithm_betters_the_printed_pair(problem, value):
    printed = jnp.log(jnp.array([0.0571, 0.0677]))
    before, _ = value(problem, printed)
    settings = Settings(evaluations=120, particles=12)
    outcome = run(build_phases("ga", settings), problem, jax.random.key(0))
    after, rate = value(problem, outcome.best_position)
    assert abs(float(after) - outcome.best_value) < 1e-9
    assert outcome.best_value < float(before)
    assert float(rate) < 1.02 * LIMIT


@pytest.mark.slow
def test_gradients_through_the_rollout_and_the_singularity(problem):
    """By every number that is tuned and by the path's duration, with feedback, against differences; then descent."""
    bounds = {**BOUNDS, "position_gain": (0.01, 1.0), "attitude_gain": (0.01, 1.0)}
    fed = tuning(problem.robot, problem.target, problem.initial_state, COARSE, PathError(LIMIT), bounds)

    def smooth(candidate, duration):
        there = replace(fed, target=replace(fed.target, duration=duration), duration=duration)
        tracked = there.tracked(candidate)
        return there.index.smooth(tracked, 1.0), tracked.determinant

    slope = jit(jax.value_and_grad(smooth, argnums=(0, 1), has_aux=True))
    candidate, duration = jnp.log(jnp.array([0.0571, 0.0677, 0.1, 0.2])), jnp.array(25.0)
    (first, determinant), (found, by_duration) = slope(candidate, duration)
    assert np.min(determinant) < 0 < np.max(determinant)
    for axis in range(4):
        step = 1e-6 * jnp.eye(4)[axis]
        expected = (slope(candidate + step, duration)[0][0] - slope(candidate - step, duration)[0][0]) / 2e-6
        assert expected != 0
        np.testing.assert_allclose(found[axis], expected, rtol=1e-5)
    expected = (slope(candidate, duration + 1e-5)[0][0] - slope(candidate, duration - 1e-5)[0][0]) / 2e-5
    np.testing.assert_allclose(by_duration, expected, rtol=1e-5)
    for _ in range(6):
        _, (found, _) = slope(candidate, duration)
        candidate = candidate - 0.05 * found / jnp.linalg.norm(found)
    assert float(slope(candidate, duration)[0][0]) < 0.99 * float(first)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ({"epsilom": (0.1, 0.2)}, "did you mean 'epsilon'"),
        ({"epsilon": (0.3, 0.2)}, "in order"),
        ({"damping": (-1.0, 0.2)}, "not negative"),
        ({}, "no number was named"),
    ],
)
def test_bounds_that_make_no_sense_are_refused(problem, bounds, words):
    with pytest.raises(InputError, match=words):
        tuning(problem.robot, problem.target, problem.initial_state, COARSE, PublishedIndex(LIMIT), bounds)
