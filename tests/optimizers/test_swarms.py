"""The formulas of the swarms against closed forms, and their statistics against SciPy."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest
from shifted_functions import LOWER, UPPER, sphere

from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.population import PopulationState
from jffsr.optimizers.pso import PSO
from jffsr.optimizers.qpso import QPSO

PROBLEM = FunctionProblem(LOWER[:2], UPPER[:2], sphere)
KEY = jax.random.key(3)


def test_constriction_gives_the_published_constants():
    """Clerc and Kennedy 2002: phi = 4.1 gives 0.7298, and 1.4962 for both pulls."""
    swarm = PSO(10.0, rule="constriction")
    np.testing.assert_allclose(swarm.coefficients(0, 1.0), [0.7298, 1.4962, 1.4962], atol=5e-5)


@pytest.mark.parametrize(
    ("rule", "inertias"), [("linear", [0.9, 0.65, 0.4, 0.4]), ("success", [0.4, 0.525, 0.9])]
)
def test_inertia_that_changes(rule, inertias):
    swarm = PSO(10.0, rule=rule)
    if rule == "linear":
        found = [swarm.coefficients(generation, 1.0)[0] for generation in (0, 5, 10, 12)]
    else:
        found = [swarm.coefficients(7, share)[0] for share in (0.0, 0.25, 1.0)]
    np.testing.assert_allclose(found, inertias, rtol=1e-12)


def test_share_of_successes_is_counted():
    swarm = PSO(10.0, particles=4, rule="success")
    state = swarm.init(KEY, PROBLEM)
    _, _, (_, share) = swarm.keep(state, jnp.array([1.0, 2.0, jnp.inf, 3.0]))
    assert share == 0.75


def test_a_particle_alone_follows_the_recurrence_of_its_velocity():
    """At its own and the swarm's best nothing pulls: the velocity is the inertia times the last, up to the limit."""
    swarm = PSO(10.0, particles=1, inertia=0.5, velocity_limit=0.1)
    place = jnp.array([[0.5, 0.5]])
    state = swarm.init(KEY, PROBLEM)
    own = (jnp.array([[0.4, 6.0]]), jnp.ones(()))
    progress = replace(state.progress, best_position=place[0])
    state = PopulationState(KEY, place, place, jnp.zeros(1), own, progress)
    position, (after, _) = swarm.propose(PROBLEM, KEY, 0, state)
    limit = 0.1 * (UPPER[1] - LOWER[1])
    np.testing.assert_allclose(after, [[0.2, limit]], rtol=1e-12)
    np.testing.assert_allclose(position, place + after, rtol=1e-12)


def test_a_particle_stops_at_the_bound():
    swarm = PSO(10.0, particles=1)
    state = swarm.init(KEY, PROBLEM)
    place = jnp.asarray(UPPER[None, :2])
    own = (jnp.array([[1.0, -1.0]]), jnp.ones(()))
    progress = replace(state.progress, best_position=place[0])
    state = PopulationState(KEY, place, place, jnp.zeros(1), own, progress)
    position, (velocity, _) = swarm.propose(PROBLEM, KEY, 0, state)
    assert position[0, 0] == UPPER[0]
    assert velocity[0, 0] == 0.0
    assert velocity[0, 1] != 0.0


@pytest.mark.parametrize(
    ("shape", "middle"),
    [("linear", 0.75), ("cosine", 0.75), ("exponential", np.sqrt(0.5)), ("constant", 1.0)],
)
def test_contraction_over_the_generations(shape, middle):
    swarm = QPSO(100.0, shape=shape)
    last = 1.0 if shape == "constant" else 0.5
    found = [swarm.contraction(jnp.asarray(k)) for k in (0, 50, 100, 150)]
    np.testing.assert_allclose(found, [1.0, middle, last, last], rtol=1e-12)


def test_any_optax_schedule():
    steps = optax.piecewise_constant_schedule(1.2, {3: 0.5})
    swarm = QPSO(100.0, schedule=steps)
    np.testing.assert_allclose([swarm.contraction(jnp.asarray(k)) for k in (0, 2, 4)], [1.2, 1.2, 0.6])


def test_weighted_mean_best():
    """Five particles weigh 1.5, 1.25, 1, 0.75, 0.5 from the best to the worst."""
    swarm = QPSO(10.0, particles=5, mean_best="weighted")
    state = swarm.init(KEY, PROBLEM)
    values = np.array([3.0, np.inf, 1e100, -2.0, 5.0])
    weights = np.array([1.25, 0.5, 0.75, 1.5, 1.0])
    state = PopulationState(KEY, state.position, state.kept, jnp.asarray(values), (), state.progress)
    np.testing.assert_allclose(swarm._mean_best(state), weights @ np.asarray(state.kept) / 5, rtol=1e-12)
