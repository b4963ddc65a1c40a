"""The adaptive reference in a closed loop with a robot that does as it is told, and its codes where it cannot."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.reactionless.estimation.adaptive import ADAPTIVE_SENTENCES, AdaptiveCode, AdaptiveReactionless
from jffsr.reactionless.estimation.balance import Load, balance_of, load_blocks
from jffsr.reactionless.estimation.commanded import LoadHistory, SensorNoise, commanded_run
from jffsr.reactionless.estimation.excitation import SineSum
from jffsr.reactionless.estimation.forgetting import ClockForgetting
from jffsr.reactionless.estimation.least_squares import RecursiveLeastSquares
from jffsr.reactionless.estimation.models import KnownLoad, RegressedLoad
from jffsr.reactionless.estimation.parameters import LoadParameters
from jffsr.reactionless.interface import Measured

ROBOT = jffsr.load_robot("ye_2019_planar3")
COUNT, PERIOD = 800, 0.02
START = jnp.array([0.3, -0.5, 0.7])
LOAD = Load(jnp.array(5.0), jnp.array([0.1, 0.0, 0.0]), 2.5 * jnp.eye(3))
MOMENTUM = jnp.array([0.0, 0.0, 1.25])
EXCITATION = SineSum.spread(3)


def measured(q, rates, base_rate=0.0, fresh=True) -> Measured:
    return Measured(
        jnp.array([1.0, 0, 0, 0]), jnp.array([0, 0, base_rate]), jnp.zeros(6), q, rates, jnp.asarray(fresh)
    )


@pytest.fixture(scope="module")
def learning():
    """Sixteen seconds after a capture, with a load to be learnt; one program for all."""
    reference = AdaptiveReactionless(ROBOT, LoadParameters(), PERIOD, EXCITATION, rate_limit=0.3, axes=(2,))

    @jax.jit
    def run(load, momentum, noise, lost):
        history = LoadHistory(load, load, jnp.inf, momentum)
        return commanded_run(
            ROBOT, history, reference, START, jnp.zeros(3), PERIOD, COUNT, noise, jax.random.PRNGKey(2), lost
        )

    def found(load=LOAD, noise=0.0, lost=None):
        lost = np.zeros(COUNT, dtype=bool) if lost is None else lost
        return run(load, MOMENTUM, SensorNoise(noise, noise, 10 * noise), lost)

    return found


def settled(run, samples: int = 100) -> float:
    return float(np.sqrt(np.mean(np.asarray(run.base_rate[-samples:, 2]) ** 2)))


def test_the_base_comes_to_rest(learning):
    run = learning()
    # Locked, the joints would leave it turning at some 0.01 rad/s.
    assert np.abs(run.base_rate[0, 2]) > 5e-3
    assert settled(run) < 2e-5
    assert np.all(np.asarray(run.states.code) == AdaptiveCode.HELD)
    np.testing.assert_allclose(np.exp(2 * run.states.model.numbers[-1, 0]), 5.0, rtol=0.05)


def test_it_comes_to_rest_under_noise(learning):
    assert settled(learning(noise=1e-5)) < 1e-4


def test_ten_times_heavier(learning):
    heavy = Load(jnp.array(50.0), jnp.array([0.1, 0.0, 0.0]), 25.0 * jnp.eye(3))
    run = learning(heavy)
    assert settled(run) < 1e-4
    assert np.all(np.isfinite(run.joint_position))


def test_two_seconds_without_measurements(learning):
    lost = np.zeros(COUNT, dtype=bool)
    lost[300:400] = True
    run = learning(lost=lost)
    code = np.asarray(run.states.code)
    assert np.all(code[300:400] == AdaptiveCode.MEASUREMENT_LOST)
    assert np.all(code[400:] == AdaptiveCode.HELD)
    np.testing.assert_array_equal(run.states.model.numbers[299], run.states.model.numbers[399])
    # The estimate at hand carries it through.
    assert np.abs(run.base_rate[300:400, 2]).max() < 1e-3
    assert settled(run) < 2e-5


@pytest.fixture(scope="module")
def known():
    """One step of a reference that knows the load, over traced momentum, limits and measurements."""
    start = measured(START, jnp.zeros(3))

    @jax.jit
    def step(momentum, rate_limit, acceleration_limit, gain, sample):
        model = KnownLoad(LOAD, momentum)
        limits = rate_limit, acceleration_limit, gain
        reference = AdaptiveReactionless(ROBOT, model, PERIOD, EXCITATION, *limits)
        return reference.advance(reference.begin(start), 1.3, sample)

    def found(momentum=MOMENTUM, limit=np.inf, acceleration=np.inf, gain=0.0, sample=start):
        return step(momentum, jnp.full(3, limit), acceleration, gain, sample)

    return found


def turning(rates, momentum=MOMENTUM):
    """The base's rate about z, rad/s, by the blocks of robot and load."""
    balance = balance_of(ROBOT, measured(START, rates))
    locked, coupling = load_blocks(balance, LOAD)
    return np.linalg.solve(balance.locked + locked, momentum - (balance.coupling + coupling) @ rates)[2]


def test_rate_limits_shrink_the_null_motion_first(known):
    _, free = known()
    assert abs(turning(free.joint_velocity)) < 1e-12
    peak = float(np.abs(free.joint_velocity).max())
    state, kept = known(limit=0.7 * peak)
    np.testing.assert_allclose(np.abs(kept.joint_velocity).max(), 0.7 * peak, rtol=1e-9)
    assert abs(turning(kept.joint_velocity)) < 1e-12
    assert int(state.code) == AdaptiveCode.HELD
    # Less than the momentum itself asks for: the base turns, and that is said.
    state, less = known(limit=1e-3)
    np.testing.assert_allclose(np.abs(less.joint_velocity).max(), 1e-3, rtol=1e-9)
    assert int(state.code) == AdaptiveCode.RATE_LIMITED
    assert abs(turning(less.joint_velocity)) > 1e-4


def test_rates_change_no_faster_than_allowed(known):
    _, free = known()
    state, slow = known(acceleration=0.1)
    np.testing.assert_allclose(np.abs(slow.joint_acceleration).max(), 0.1, rtol=1e-9)
    direction = np.asarray(free.joint_velocity / slow.joint_velocity)
    np.testing.assert_allclose(direction, direction[0], rtol=1e-9)
    np.testing.assert_allclose(slow.joint_position, START)
    np.testing.assert_allclose(state.joint_position, START + PERIOD * slow.joint_velocity)


def test_lost_rank_and_broken_measurements_are_said(known):
    state, desired = known(jnp.array([0.4, 0.0, 1.25]))
    assert int(state.code) == AdaptiveCode.RANK_LOST
    assert int(state.rank) == 1
    assert np.all(np.isfinite(desired.joint_velocity))
    state, desired = known(jnp.array([0.0, 0.0, jnp.nan]))
    assert int(state.code) == AdaptiveCode.NOT_FINITE
    np.testing.assert_array_equal(desired.joint_velocity, 0.0)
    broken = measured(START, jnp.array([0.0, jnp.nan, 0.0]))
    state, desired = known(sample=replace(broken, joint_velocity=jnp.array([0.1, jnp.nan, 0.0])))
    assert int(state.code) == AdaptiveCode.MEASUREMENT_LOST
    assert set(ADAPTIVE_SENTENCES) == set(AdaptiveCode)


def test_the_base_is_turned_back(known):
    """Away by an angle since the start, it returns at the gain times that."""
    half = 0.05
    turned = jnp.array([np.cos(half), 0, 0, np.sin(half)])
    sample = replace(measured(START, jnp.zeros(3)), base_quaternion=turned)
    _, desired = known(gain=0.5, sample=sample)
    np.testing.assert_allclose(turning(desired.joint_velocity), -0.5 * 2 * half, rtol=1e-9)


@pytest.mark.slow
def test_sampling_is_what_is_left_with_a_known_load():
    """Held over a sample, rates are right at its start only: the base's rate at its end falls with the period."""
    reference = AdaptiveReactionless(ROBOT, KnownLoad(LOAD, MOMENTUM), 0.0, EXCITATION, axes=(2,))

    @jax.jit
    def peak(period):
        run = commanded_run(
            ROBOT,
            LoadHistory(LOAD, LOAD, jnp.inf, MOMENTUM),
            replace(reference, period=period),
            START,
            jnp.zeros(3),
            period,
            200,
        )
        return jnp.max(jnp.abs(run.base_rate[10:, 2]))

    coarse, fine = float(peak(0.02)), float(peak(0.002))
    assert coarse < 1e-4
    assert 5 < coarse / fine < 30


@pytest.mark.slow
def test_regression_that_forgets_holds_too():
    """The published law, with r = 0.01 (N m s)^2: an order better than plain least squares after a change of load."""
    other = Load(jnp.array(8.0), jnp.array([0.3, 0.1, 0.0]), 4.0 * jnp.eye(3))
    history = LoadHistory(LOAD, other, 20.0, MOMENTUM)
    found = {}
    for name, estimator in {
        "clock": RecursiveLeastSquares(ClockForgetting(), variance=1e-2),
        "plain": RecursiveLeastSquares(variance=1e-2),
    }.items():
        reference = AdaptiveReactionless(ROBOT, RegressedLoad(estimator), 0.01, EXCITATION, axes=(2,))
        run = jax.jit(
            lambda reference=reference: commanded_run(
                ROBOT, history, reference, START, jnp.zeros(3), 0.01, 4000
            )
        )()
        found[name] = settled(run, 500)
    assert found["clock"] < 1e-4
    assert found["clock"] < 0.1 * found["plain"]
