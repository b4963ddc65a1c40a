"""Control laws against their formulas, the equations of motion, and what sampling does to them."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import PERIOD, POSTURE, ROBOT, START, UPRIGHT
from scipy.special import expit

import jffsr
from jffsr.compiling import jit
from jffsr.reactionless.control.computed_torque import ComputedTorque
from jffsr.reactionless.control.errors import Gains, decoupled_inertia
from jffsr.reactionless.control.extreme_learning import ExtremeLearning, machine_weights, random_machine
from jffsr.reactionless.control.proportional_derivative import ProportionalDerivative
from jffsr.reactionless.control.recorded import Recorded
from jffsr.reactionless.interface import Desired, Measured

RNG = np.random.default_rng(5)
POSITION, VELOCITY = POSTURE + 0.1 * RNG.normal(size=3), RNG.normal(size=3)
DESIRED = Desired(POSTURE, RNG.normal(size=3), RNG.normal(size=3))
RATE, SLOPE = np.array([100.0, 50.0, 50.0]), np.array([2.0, 1.0, 1.0])
E, E_DOT = DESIRED.joint_position - POSITION, DESIRED.joint_velocity - VELOCITY
R = E_DOT + SLOPE * E


def seen(fresh=True, base_rate=(0.0, 0.0, 0.0), quaternion=UPRIGHT):
    return Measured(quaternion, jnp.asarray(base_rate), np.zeros(6), POSITION, VELOCITY, jnp.array(fresh))


def test_the_decoupled_inertia_is_what_a_joint_feels_while_the_others_give_way():
    inertia = np.asarray(decoupled_inertia(ROBOT, POSTURE))
    kin = jffsr.kinematics(ROBOT, START)
    for joint in range(3):
        torque = np.eye(3)[joint]
        felt = jffsr.forward_dynamics(ROBOT, kin, np.zeros(6), np.zeros(3), torque)[6 + joint]
        np.testing.assert_allclose(inertia[joint] * felt, 1.0, rtol=1e-12)


def test_with_the_diagonal_of_the_inertia_the_published_gains_are_unstable_at_100_hz():
    """Rates go as qd+ = (1 - T H*^-1 M K) qd between samples; stable where all factors are below one."""
    straight = jffsr.State(np.zeros(3), UPRIGHT, np.zeros(3))
    held = np.diag(jffsr.generalized_inertia(ROBOT, jffsr.kinematics(ROBOT, straight)))
    free = np.asarray(decoupled_inertia(ROBOT, np.zeros(3)))
    assert 9.0 < (held / free).max() < 9.5

    def largest_factor(inertia):
        h = np.asarray(jffsr.generalized_inertia(ROBOT, jffsr.kinematics(ROBOT, straight)))
        step = np.eye(3) - PERIOD * np.linalg.solve(h, np.diag(inertia * RATE))
        return np.abs(np.linalg.eigvals(step)).max()

    assert largest_factor(held) > 4
    assert largest_factor(free) < 1


def test_published_gains():
    gains = Gains.published(3)
    np.testing.assert_array_equal(gains.rate, RATE)
    np.testing.assert_array_equal(gains.slope, SLOPE)
    np.testing.assert_array_equal(Gains.published(1).rate, [100.0])
    with pytest.raises(jffsr.InputError, match="num_joints is 0"):
        Gains.published(0)


def test_pd():
    controller = ProportionalDerivative.of(ROBOT, POSTURE)
    _, torque = controller.advance((), 0.0, seen(), DESIRED)
    np.testing.assert_allclose(torque, decoupled_inertia(ROBOT, POSTURE) * RATE * R, rtol=1e-12)
    _, blind = controller.advance((), 0.0, seen(fresh=False), DESIRED)
    np.testing.assert_array_equal(blind, 0.0)


def test_extreme_learning_machine():
    free = np.asarray(random_machine(jax.random.key(1), 7))
    assert free.shape == (42,)
    assert 0 <= free.min() < free.max() < 1
    a, b = free[:35].reshape(7, 5), free[35:]
    controller = ExtremeLearning.of(ROBOT, POSTURE, free, rate=2.0, bound=1.5, period=0.02)
    beta = RNG.normal(size=(3, 7))
    following, torque = controller.advance(jnp.asarray(beta), 0.0, seen(), DESIRED)
    inertia = np.asarray(decoupled_inertia(ROBOT, POSTURE))
    motion = DESIRED.joint_acceleration, DESIRED.joint_velocity, DESIRED.joint_position
    for j in range(3):
        x = np.array([motion[0][j], motion[1][j], motion[2][j], E[j], E_DOT[j]])
        hidden = expit(a @ x + b)
        expected = inertia[j] * (RATE[j] * R[j] + hidden @ beta[j] + 1.5 * np.sign(R[j]))
        np.testing.assert_allclose(torque[j], expected, rtol=1e-12)
        np.testing.assert_allclose(following[j], beta[j] + 0.02 * 2.0 * hidden * R[j], rtol=1e-12)
    np.testing.assert_array_equal(controller.begin(seen()), np.zeros((3, 7)))
    # Not measured: what was learnt goes on to act, nothing is learnt.
    kept, blind = controller.advance(jnp.asarray(beta), 0.0, seen(fresh=False), DESIRED)
    np.testing.assert_array_equal(kept, beta)
    assert np.all(np.asarray(blind) != 0)


def test_a_width_rounds_the_robust_term():
    free = random_machine(jax.random.key(1), 3)
    sharp = ExtremeLearning.of(ROBOT, POSTURE, free)
    nothing = jnp.zeros((3, 3))
    torque = {w: replace(sharp, width=w).advance(nothing, 0.0, seen(), DESIRED)[1] for w in (0.0, 1e-9, 1e3)}
    np.testing.assert_allclose(torque[1e-9], torque[0.0], rtol=1e-12)
    _, pd = ProportionalDerivative(sharp.inertia, sharp.gains).advance((), 0.0, seen(), DESIRED)
    np.testing.assert_allclose(torque[1e3], pd + np.asarray(sharp.inertia) * R / 1e3, rtol=1e-9)

    def gradient(width):
        def total(position):
            measured = replace(seen(), joint_position=position, joint_velocity=DESIRED.joint_velocity)
            return jnp.sum(replace(sharp, width=width).advance(nothing, 0.0, measured, DESIRED)[1])

        return jax.grad(total)(jnp.asarray(POSTURE))

    # At zero error too.
    assert np.all(np.isfinite(gradient(0.0)))
    assert np.all(np.isfinite(gradient(0.1)))


@pytest.mark.parametrize("size", [(5,), (0,), (2, 6)])
def test_weights_that_are_no_machines_are_refused(size):
    with pytest.raises(jffsr.InputError, match="a multiple of 6"):
        machine_weights(np.zeros(size))
    with pytest.raises(jffsr.InputError, match="nodes is 0"):
        random_machine(jax.random.key(0), 0)


def test_computed_torque_gives_the_acceleration_it_wants():
    """On its own model, whatever the base does: turned, spinning, and drifting, which it is not told."""
    quaternion = np.array([0.8, 0.2, -0.4, 0.4])
    twist = np.array([0.7, -0.4, 0.2, 0.1, -0.2, 0.3])
    controller = ComputedTorque.of(ROBOT)

    @jit
    def accelerations():
        measured = seen(base_rate=twist[3:], quaternion=quaternion)
        _, torque = controller.advance((), 0.0, measured, DESIRED)
        state = jffsr.State(np.ones(3), quaternion, POSITION)
        return jffsr.forward_dynamics(ROBOT, jffsr.kinematics(ROBOT, state), twist, VELOCITY, torque)[6:]

    wanted = DESIRED.joint_acceleration + RATE * R + SLOPE * E_DOT
    np.testing.assert_allclose(accelerations(), wanted, rtol=1e-10)


def test_a_recording_is_played_and_its_end_held():
    times = PERIOD * np.arange(3)

    def motion(t):
        return jnp.sin(t) * jnp.ones(2), jnp.cos(t) * jnp.ones(2), -jnp.sin(t) * jnp.ones(2)

    record = Recorded.of(motion, 3, PERIOD)
    state = record.begin(seen())
    for k in range(5):
        state, desired = record.advance(state, 0.0, seen())
        at = times[min(k, 2)]
        np.testing.assert_allclose(desired.joint_position, np.sin(at), atol=1e-15)
        np.testing.assert_allclose(desired.joint_velocity, np.cos(at) if k < 3 else 0.0, atol=1e-15)
        np.testing.assert_allclose(desired.joint_acceleration, -np.sin(at) if k < 3 else 0.0, atol=1e-15)
