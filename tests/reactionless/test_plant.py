"""The closed loop's plant: momentum, the pendulum's stroke, delay, limits, sensors, disturbance, codes."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import POSTURE, ROBOT, START, Echo, loaded, waves

import jffsr
from jffsr.compiling import jit
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.proportional_derivative import ProportionalDerivative
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_computer import measure
from jffsr.reactionless.plant_run import LoopCode, longest_stretch, loop_code, loop_sentence
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings, Sensors, Strike
from jffsr.reactionless.plant_strike import Pendulum

SAMPLES = 60
DELAY = 3


@pytest.fixture(scope="module")
def run():
    """One program for all: a delayed, limited, noisy loop with a stroke, every number of it an argument."""

    def loop(controller, settings, key):
        return closed_loop(loaded(), START, waves(SAMPLES), controller, settings, key)

    program = jit(loop)

    def call(controller, key=0, **changes):
        strike = Strike(np.zeros(6), 0.2)
        settings = LoopSettings(SAMPLES, substeps=2, delay=DELAY, strike=strike)
        settings = replace(settings, **{"torque_limit": np.full(3, np.inf), **changes})
        strongly = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), settings)
        return program(controller, strongly, jax.random.key(key))

    return call


@pytest.fixture(scope="module")
def feedback():
    soft = Gains(np.array([4.0, 3.0, 2.0]), np.ones(3))
    return ProportionalDerivative.of(ROBOT, POSTURE, soft)


def test_the_pendulums_formulas_give_more_than_is_printed():
    pendulum = Pendulum()
    np.testing.assert_allclose([pendulum.force, pendulum.moment], [75.6, 3.78], rtol=2e-4)
    np.testing.assert_allclose(pendulum.strike(1.0).wrench, [0, 0, 0, 0, 0, pendulum.moment])
    np.testing.assert_allclose(pendulum.strike(1.0, True).wrench[1], pendulum.force / 2, rtol=1e-12)


def test_momentum_is_conserved_under_torques_noise_and_disturbance(run, feedback):
    noisy = Sensors(gyro=1e-3, encoder=1e-4, rate=1e-3)
    found = run(feedback, sensors=noisy, disturbance=JointDisturbance.published())
    assert float(np.abs(found.states.joint_velocity).max()) > 0.1
    np.testing.assert_allclose(found.momentum, 0.0, atol=1e-8)


def test_a_stroke_gives_its_impulse(run, feedback):
    """In the middle of a step too: it begins at 0.2037 s."""
    strike = Pendulum().strike(0.2037, with_force=True)
    found = run(feedback, strike=strike)
    before = found.time < 0.2037
    np.testing.assert_allclose(found.momentum[before], 0.0, atol=1e-9)
    after = np.asarray(found.momentum[found.time > 0.22])
    assert np.ptp(after, axis=0).max() < 1e-7
    # The tool's y axis and the arm from the common centre of mass, at the stroke.
    robot = loaded()
    at = int(np.searchsorted(found.time, 0.2087))
    state = jax.tree.map(lambda x: x[at], found.states)
    kin = jffsr.kinematics(robot, state)
    tool, _ = jffsr.end_effector_pose(robot, kin)
    turned = float(np.sum(state.joint_position)) + 2 * np.arctan2(
        state.base_quaternion[3], state.base_quaternion[0]
    )
    impulse = 0.01 * strike.wrench[1] * np.array([-np.sin(turned), np.cos(turned), 0.0])
    np.testing.assert_allclose(after[0, :3], impulse, atol=2e-3 * np.linalg.norm(impulse))
    lever = np.asarray(tool - jffsr.system_com(robot, kin))
    turning = np.cross(lever, impulse) + np.array([0, 0, 0.01 * strike.wrench[5]])
    np.testing.assert_allclose(after[0, 3:], turning, atol=5e-3 * np.linalg.norm(turning))
    only_moment = run(feedback, strike=Pendulum().strike(0.2037))
    after = np.asarray(only_moment.momentum[-1])
    np.testing.assert_allclose(after, [0, 0, 0, 0, 0, 0.01 * Pendulum().moment], atol=1e-9)


def test_torque_comes_late_and_limited(run, feedback):
    limit = np.array([0.05, 0.5, 0.01])
    found = run(feedback, torque_limit=limit)
    asked = np.asarray(found.asked_torque)
    np.testing.assert_array_equal(found.torque[:DELAY], 0.0)
    np.testing.assert_array_equal(found.torque[DELAY:], np.clip(asked[:-DELAY], -limit, limit))
    acted = np.asarray(found.limited)
    np.testing.assert_array_equal(acted[DELAY:], np.abs(asked[:-DELAY]) > limit)
    assert acted.any()
    assert not acted.all()
    assert int(found.code) == LoopCode.TORQUE_LIMITED
    assert "torque limits" in found.sentence


def test_lost_measurements_are_held(run):
    found = run(Echo(1e-3, 0), sensors=Sensors(lost_from=0.2, lost_until=0.4, encoder=1e-3))
    lost = ~np.asarray(found.fresh)
    np.testing.assert_array_equal(np.flatnonzero(lost), np.arange(20, 40))
    asked = np.asarray(found.asked_torque)
    np.testing.assert_array_equal(asked[lost], np.broadcast_to(asked[19], (20, 3)))
    assert np.all(asked[41] != asked[19])
    assert np.all(asked[18] != asked[19])


def test_sensors_have_the_noise_that_was_asked_for():
    state = replace(START, base_twist=np.array([1.0, 2, 3, 0.1, 0.2, 0.3]), joint_velocity=np.arange(3.0))
    sensors = Sensors(gyro=0.3, encoder=0.1, rate=0.2, accelerometer=0.5)
    settings = LoopSettings(2, sensors=sensors)
    keys = jax.random.split(jax.random.key(4), 3000)
    seen = jax.vmap(lambda key: measure(settings, state, jnp.arange(6.0), key))(keys)
    rows = (
        (seen.base_rate, [0.1, 0.2, 0.3], 0.3),
        (seen.base_acceleration, np.arange(6.0), 0.5),
        (seen.joint_position, POSTURE, 0.1),
        (seen.joint_velocity, np.arange(3.0), 0.2),
    )
    for values, mean, deviation in rows:
        np.testing.assert_allclose(np.mean(values, axis=0), mean, atol=5 * deviation / np.sqrt(3000))
        np.testing.assert_allclose(np.std(values, axis=0), deviation, rtol=0.07)
    together = np.concatenate([np.asarray(values) for values, _, _ in rows], axis=1)
    assert np.abs(np.corrcoef(together.T) - np.eye(together.shape[1])).max() < 0.09
    np.testing.assert_array_equal(seen.base_quaternion, np.broadcast_to(START.base_quaternion, (3000, 4)))


def test_the_disturbance_is_the_papers(run, feedback):
    found = run(feedback, disturbance=JointDisturbance.published())
    rate, push = np.asarray(found.states.joint_velocity), np.asarray(found.disturbance)
    np.testing.assert_array_equal(push[0], 0.5)  # at rest the sign is zero
    share = (push[1:] - 0.5) * np.sign(rate[1:])
    assert share.min() >= 0
    assert share.max() < 1
    np.testing.assert_allclose(share.mean(), 0.5, atol=0.1)
    again = run(feedback, disturbance=JointDisturbance.published())
    np.testing.assert_array_equal(push, again.disturbance)
    assert np.any(push != np.asarray(run(feedback, 1, disturbance=JointDisturbance.published()).disturbance))


def test_runaway_and_nan_are_told(run, feedback):
    assert int(run(feedback).code) == LoopCode.KEPT
    assert int(run(Echo(500.0, 0)).code) == LoopCode.DIVERGED
    assert int(run(Echo(np.nan, 1)).code) == LoopCode.NOT_FINITE


def crafted(error=0.0, limited=None, rate=0.0, spin=0.0):
    n = 50
    states = jffsr.State(
        np.zeros((n, 3)), np.zeros((n, 4)), np.zeros((n, 3)), np.zeros((n, 6)), np.zeros((n, 3))
    )
    states.joint_velocity[7, 1], states.base_twist[9, 4] = rate, spin
    flags = np.zeros((n, 3), dtype=bool) if limited is None else limited
    settings = LoopSettings(n, period=0.1)
    return int(loop_code(settings, states, np.full((n, 3), error), np.zeros((n, 3)), flags))


def test_codes_go_from_bad_to_good():
    stretch = np.zeros((50, 3), dtype=bool)
    stretch[10:21, 1] = True
    assert int(longest_stretch(stretch)) == 11
    assert crafted() == LoopCode.KEPT
    assert crafted(error=0.2) == LoopCode.REFERENCE_LOST
    assert crafted(limited=stretch, error=0.2) == LoopCode.SATURATED
    stretch[15, 1] = False
    assert crafted(limited=stretch) == LoopCode.TORQUE_LIMITED
    assert crafted(limited=stretch, error=0.2) == LoopCode.REFERENCE_LOST
    assert crafted(rate=-11.0, error=0.2) == LoopCode.DIVERGED
    assert crafted(spin=1.1) == LoopCode.DIVERGED
    assert crafted(rate=np.nan) == LoopCode.NOT_FINITE
    assert crafted(error=np.nan) == LoopCode.NOT_FINITE
    sentences = {loop_sentence(code) for code in LoopCode}
    assert len(sentences) == len(LoopCode)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: LoopSettings(1), "samples is 1"),
        (lambda: LoopSettings(10, substeps=0), "substeps is 0"),
        (lambda: LoopSettings(10, delay=-1), "delay is -1"),
        (lambda: LoopSettings(10, delay=0.5), "delay is 0.5"),
        (lambda: LoopSettings(10, period=0.0), "period is 0.0 s"),
        (lambda: LoopSettings(10, torque_limit=np.array([1.0, -1.0])), "torque_limit"),
        (lambda: Sensors(gyro=-1.0), "gyro is -1.0"),
        (lambda: Sensors(encoder=np.nan), "encoder is nan"),
        (lambda: Strike(np.zeros(6), 0.0, 0.0), "duration of a strike is 0.0 s"),
    ],
)
def test_settings_without_sense_are_refused(make, told):
    with pytest.raises(jffsr.InputError, match=told):
        make()


def test_what_does_not_fit_the_robot_is_refused(feedback):
    def loop(state=START, **changes):
        closed_loop(ROBOT, state, waves(5), feedback, LoopSettings(5, **changes), jax.random.key(0))

    with pytest.raises(jffsr.InputError, match=r"shape \(2,\); robot 'ye_2019_planar3' has 3 joints"):
        loop(replace(START, joint_position=np.zeros(2)))
    with pytest.raises(jffsr.InputError, match="torque_limit has shape"):
        loop(torque_limit=np.ones(4))
    with pytest.raises(jffsr.InputError, match="wrench has shape"):
        loop(strike=Strike(np.zeros(3), 0.0))
    with pytest.raises(jffsr.InputError, match=r"gains\.slope has shape"):
        ProportionalDerivative.of(ROBOT, POSTURE, Gains(np.ones(3), np.ones(1)))


@pytest.mark.slow
def test_derivatives_of_a_run_are_finite_differences():
    """Of a late joint angle, by the gains and the load's mass, through sensors, limits and the plant."""

    def outcome(values):
        gain, mass = values
        gains = Gains(gain * np.array([4.0, 3.0, 2.0]), np.ones(3))
        robot = jffsr.weld(ROBOT, jffsr.RigidBody(mass, np.zeros(3), 2.5 * jnp.eye(3)))
        controller = ProportionalDerivative.of(ROBOT, POSTURE, gains)
        settings = LoopSettings(30, sensors=Sensors(gyro=1e-3, encoder=1e-4, rate=1e-3), torque_limit=50.0)
        run = closed_loop(robot, START, waves(30, 0.5), controller, settings, jax.random.key(1))
        return run.states.joint_position[-1, 2]

    at = jnp.array([1.0, 5.0])
    value, slope = jit(jax.value_and_grad(outcome))(at)
    compiled = jit(outcome)
    h = 1e-5
    differences = [(compiled(at + h * e) - compiled(at - h * e)) / (2 * h) for e in np.eye(2)]
    assert np.isfinite(value)
    np.testing.assert_allclose(slope, differences, rtol=1e-5, atol=1e-10)
