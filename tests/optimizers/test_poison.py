"""Objectives that are NaN at 1, 50, 99 and 100 percent of all candidates."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from shifted_functions import Poisoned, sphere

from jffsr.optimizers.driver import run
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.interface import Population
from jffsr.optimizers.registry import Settings, build_phases

SETTINGS = Settings(
    particles=20,
    evaluations=600,
    swarm_evaluations=600,
    starts=16,
    gradient_iterations=40,
    polish_iterations=10,
    memory=4,
)


def outcome_of(optimizer: str, percent: int):
    problem = Poisoned(np.array(percent))
    return problem, run(build_phases(optimizer, SETTINGS), problem, jax.random.key(2))


def test_the_hash_poisons_the_share_it_says():
    x = jax.random.uniform(jax.random.key(0), (20_000, 4), minval=-2.0, maxval=5.0)
    for percent in (0, 1, 50, 99, 100):
        share = 100 * np.mean(jax.vmap(Poisoned(np.array(percent)).is_poisoned)(x))
        assert share == pytest.approx(percent, abs=0.0 if percent in (0, 100) else 1.0)


@pytest.mark.parametrize("percent", [1, 50, 99])
@pytest.mark.parametrize("optimizer", ["qpso", "hybrid", "gradient"])
def test_finite_best_among_poisoned_candidates(optimizer, percent):
    problem, outcome = outcome_of(optimizer, percent)
    assert np.isfinite(outcome.best_value)
    assert not problem.is_poisoned(jnp.asarray(outcome.best_position))
    assert outcome.best_value == pytest.approx(float(sphere(outcome.best_position)), rel=1e-12)
    assert outcome.best_value == min(record.best_value for record in outcome.history)


@pytest.mark.parametrize("optimizer", ["qpso", "hybrid", "gradient"])
def test_nothing_but_nan_gives_an_infinite_best(optimizer):
    problem, outcome = outcome_of(optimizer, 100)
    lower, upper = problem.bounds()
    assert outcome.best_value == np.inf
    assert np.all((outcome.best_position >= lower) & (outcome.best_position <= upper))


def test_starts_that_gave_nothing_keep_what_the_swarm_knew():
    """Every gradient is NaN, so the descents are idle; the values that came with the starts are not lost."""
    problem = Poisoned(np.array(100))
    positions = jnp.tile(jnp.linspace(0.0, 1.0, 5)[:, None], (1, 4))
    given = Population(positions, jnp.array([3.0, jnp.nan, 1.0, jnp.inf, 2.0]))
    descent = GradientDescent(starts=3, memory=4)
    state = descent.init(jax.random.key(0), problem, given)
    state = jax.jit(descent.step)(problem, state)
    assert state.progress.best_value == 1.0
    np.testing.assert_array_equal(state.progress.best_position, positions[2])
    np.testing.assert_array_equal(descent.population(state).values, [1.0, 2.0, 3.0])
