"""The load's parameters from a spatial arm's momentum balance: convergence, change of load, what is lost, heavy
loads."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.reactionless.estimation.balance import Load, balance_of, load_blocks
from jffsr.reactionless.estimation.parameters import LoadParameters
from jffsr.reactionless.estimation.pseudo_inertia import parameters_from_load
from jffsr.reactionless.interface import Measured

ROBOT = jffsr.load_robot("servicer_7dof")
COUNT = 500
FIRST = Load(np.array(40.0), np.array([0.2, -0.1, 0.3]), np.diag([3.0, 4.0, 5.0]))
HEAVY = Load(np.array(400.0), np.array([0.2, -0.1, 0.3]), np.diag([30.0, 40.0, 50.0]))
OTHER = Load(np.array(70.0), np.array([0.4, 0.1, 0.2]), np.diag([6.0, 7.0, 8.0]))
MOMENTUM = np.array([1.0, -2.0, 0.5])


@pytest.fixture(scope="module")
def estimate():
    """Estimates over a rich motion at 10 Hz whose base turns as the momentum of the true loads asks for."""
    model = LoadParameters(base_rate_noise=1e-5, joint_rate_noise=1e-5)
    rng = np.random.default_rng(12)
    frequency, phase = rng.uniform(0.05, 0.2, size=(2, 7)), rng.uniform(0, 6, size=(2, 7))
    time = 0.1 * np.arange(COUNT)
    angle = 2 * np.pi * frequency[:, None] * time[:, None] + phase[:, None]
    q = 0.5 * np.sum(np.sin(angle), axis=0)
    rates = 0.5 * np.sum(2 * np.pi * frequency[:, None] * np.cos(angle), axis=0)
    noise = rng.normal(size=(COUNT, 3))

    def step(state, sample):
        q, rates, load, noise, fresh = sample
        measured = Measured(jnp.array([1.0, 0, 0, 0]), jnp.zeros(3), jnp.zeros(6), q, rates, jnp.array(True))
        balance = balance_of(ROBOT, measured)
        locked, coupling = load_blocks(balance, load)
        true = jnp.linalg.solve(balance.locked + locked, MOMENTUM - (balance.coupling + coupling) @ rates)
        seen = jnp.where(fresh, true + noise, 1e3)
        balance = balance_of(ROBOT, Measured(jnp.array([1.0, 0, 0, 0]), seen, jnp.zeros(6), q, rates, fresh))
        state = model.update(state, balance)
        return state, state

    @jax.jit
    def found(load, other, change, noise, fresh):
        loads = jax.tree.map(
            lambda a, b: jnp.where((jnp.arange(COUNT) < change).reshape(-1, *[1] * jnp.ndim(a)), a, b),
            load,
            other,
        )
        still = Measured(
            jnp.array([1.0, 0, 0, 0]), jnp.zeros(3), jnp.zeros(6), q[0], rates[0], jnp.array(True)
        )
        start = model.begin(balance_of(ROBOT, still))
        return jax.lax.scan(step, start, (q, rates, loads, noise, fresh))

    def run(load, other=None, change=COUNT, deviation=0.0, fresh=None):
        fresh = np.ones(COUNT, dtype=bool) if fresh is None else fresh
        return found(load, load if other is None else other, change, deviation * noise, fresh)

    return run


def close(state, load, share: float) -> None:
    """The estimate is the load to a share of its mass, of 0.1 m and of its inertia, and the momentum to that of 1 N m
    s."""
    np.testing.assert_allclose(state.load.mass, load.mass, rtol=share)
    np.testing.assert_allclose(state.load.com, load.com, atol=0.1 * share)
    np.testing.assert_allclose(state.load.inertia, load.inertia, atol=share * load.inertia[2, 2])
    np.testing.assert_allclose(state.angular_momentum, MOMENTUM, atol=share)


def test_the_load_is_found(estimate):
    state, course = estimate(FIRST)
    close(state, FIRST, 1e-3)
    assert int(state.openings) == 0
    # Within ten seconds for practical purposes, from a guess of 1 kg at the tool.
    np.testing.assert_allclose(np.exp(2 * course.numbers[100, 0]), 40.0, rtol=0.02)


def test_noise_leaves_an_error_that_the_covariance_knows(estimate):
    state, _ = estimate(FIRST, deviation=1e-5)
    close(state, FIRST, 0.05)
    deviations = np.sqrt(np.diagonal(state.covariance))
    truth = np.concatenate([parameters_from_load(FIRST), MOMENTUM])
    assert np.all(np.abs(np.asarray(state.numbers) - truth) < 5 * deviations)


def test_ten_times_heavier(estimate):
    state, _ = estimate(HEAVY)
    close(state, HEAVY, 1e-3)


def test_another_load_is_noticed_and_found(estimate):
    """The old load's samples are let go soon after the change; before it, none are."""
    state, course = estimate(FIRST, OTHER, 200)
    openings = np.asarray(course.openings)
    assert openings[199] == 0
    assert 1 <= openings[230]
    close(state, OTHER, 1e-2)
    assert np.asarray(jnp.trace(course.covariance, axis1=1, axis2=2)).max() <= 1.4 * 13 + 1e-9


def test_lost_samples_change_nothing(estimate):
    fresh = np.ones(COUNT, dtype=bool)
    fresh[100:120] = False
    state, course = estimate(FIRST, fresh=fresh)
    np.testing.assert_array_equal(course.numbers[99], course.numbers[119])
    assert int(state.count) == COUNT - 20
    close(state, FIRST, 1e-3)
