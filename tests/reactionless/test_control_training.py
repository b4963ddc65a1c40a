"""Searching for a machine's input weights: what is minimised, what is spent, and that it is bettered."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import POSTURE, ROBOT, START, loaded, waves

import jffsr
from jffsr.compiling import jit
from jffsr.reactionless.control.extreme_learning import ExtremeLearning, machine_weights
from jffsr.reactionless.control.training import MEMBERS, SEARCHES, MachineTraining, train_machine
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings

NODES, SAMPLES, EVALUATIONS = 3, 40, 120


def stacked(*trees):
    return jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(x, dtype=float) for x in leaves]), *trees)


@pytest.fixture(scope="module")
def problem():
    """Two loads on a short motion, and a machine of three nodes that learns fast."""
    robots = stacked(loaded(), loaded(8.0, 3.0))
    references = stacked(waves(SAMPLES), waves(SAMPLES, 0.2))
    controller = ExtremeLearning.of(ROBOT, POSTURE, np.zeros(6 * NODES), rate=100.0)
    settings = LoopSettings(SAMPLES, disturbance=JointDisturbance.published())
    keys = jax.random.split(jax.random.key(3), 2)
    return MachineTraining(robots, stacked(START, START), references, keys, controller, settings, NODES)


@pytest.mark.slow
def test_the_value_is_the_error_of_the_runs(problem):
    candidate = np.linspace(-1, 1, 6 * NODES)
    weights, bias = machine_weights(candidate)
    errors = []
    loop = jit(closed_loop)
    for i, robot in enumerate((loaded(), loaded(8.0, 3.0))):
        controller = replace(problem.controller, weights=weights, bias=bias)
        reference = waves(SAMPLES, 0.1 * (i + 1))
        errors.append(loop(robot, START, reference, controller, problem.settings, problem.keys[i]).error)
    value = jit(problem.value)(candidate)
    np.testing.assert_allclose(value, np.sqrt(np.mean(np.square(errors))), rtol=1e-9)
    lower, upper = problem.bounds()
    np.testing.assert_array_equal(-lower, np.ones(18))
    np.testing.assert_array_equal(upper, np.ones(18))


@pytest.mark.slow
def test_both_searches_better_the_error_with_the_same_budget(problem):
    found = {s: train_machine(problem, s, EVALUATIONS, jax.random.key(1), chunk=4) for s in SEARCHES}
    for outcome in found.values():
        assert outcome.evaluations == EVALUATIONS == 4 * MEMBERS
        assert outcome.best_value < outcome.history[0].best_value
        assert np.all(np.abs(outcome.best_position) <= 1)
        np.testing.assert_allclose(jit(problem.value)(outcome.best_position), outcome.best_value, rtol=1e-9)


def test_another_search_is_refused(problem):
    with pytest.raises(jffsr.InputError, match="allowed are pso, ssade"):
        train_machine(problem, "ga", EVALUATIONS, jax.random.key(1))
