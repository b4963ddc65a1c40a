"""Tuning the numbers of a tracker by swarms, genetics and gradients, over the whole path."""

from __future__ import annotations

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


def test_smooth_index_and_value_agree_where_no_limit_is_near(problem):
    candidate = jnp.log(jnp.array([0.2, 0.2]))
    smooth, value = jit(lambda p, x: p.smooth_and_value(x, 1.0))(problem, candidate)
    assert abs(float(smooth) / float(value) - 1) < 1e-3


@pytest.mark.parametrize("optimizer", ["qpso", "ga"])
def test_swarms_and_genetics_better_the_printed_pair(problem, value, optimizer):
    printed = jnp.log(jnp.array([0.0571, 0.0677]))
    before, _ = value(problem, printed)
    settings = Settings(evaluations=120, particles=12)
    outcome = run(build_phases(optimizer, settings), problem, jax.random.key(0))
    after, rate = value(problem, outcome.best_position)
    assert abs(float(after) - outcome.best_value) < 1e-9
    assert outcome.best_value < float(before)
    assert float(rate) < 1.02 * LIMIT


def test_gradients_through_the_rollout_go_on_from_there(problem, value):
    """A few steps of plain descent from a start inside the rate limit lower the smooth index."""
    slope = jit(jax.value_and_grad(lambda x: problem.smooth_and_value(x, 1.0)[0]))
    candidate = jnp.log(jnp.array([0.2, 0.2]))
    first, found = slope(candidate)
    step = 1e-6
    for axis in range(2):
        there = candidate.at[axis].add(step)
        back = candidate.at[axis].add(-step)
        expected = (slope(there)[0] - slope(back)[0]) / (2 * step)
        np.testing.assert_allclose(found[axis], expected, rtol=1e-5)
    for _ in range(6):
        _, found = slope(candidate)
        candidate = candidate - 0.05 * found / jnp.linalg.norm(found)
    last, _ = slope(candidate)
    assert float(last) < 0.995 * float(first)


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
