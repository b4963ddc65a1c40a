"""The adaptive law: its regressor, the skew matrix, and the energy function of its proof, number by number."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import ROBOT, UPRIGHT

import jffsr
from jffsr.compiling import jit
from jffsr.dynamics.spatial_tree import spatial_inertias
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.control.load_inertia import load_inertias, load_parameters
from jffsr.reactionless.control.passivity import (
    LoadEstimate,
    PassivityBased,
    load_regressor,
    reference_torque,
)
from jffsr.reactionless.interface import Desired, Measured

RNG = np.random.default_rng(8)
ATTITUDE = np.array([0.8, 0.2, -0.4, 0.4])
Q, QD, R = RNG.normal(size=3), RNG.normal(size=3), RNG.normal(size=3)
QDD = RNG.normal(size=3)
SPIN, ACCELERATION = RNG.normal(size=3), RNG.normal(size=6)
INERTIA = np.array([[2.0, 0.1, -0.2], [0.1, 2.5, 0.3], [-0.2, 0.3, 1.8]])
OFFSET = np.array([0.2, -0.1, 0.3])
LOADED = jffsr.weld(ROBOT, jffsr.RigidBody(7.0, np.zeros(3), INERTIA), position=OFFSET)
# In the axes of link 3, whose origin the tool is 1 m from.
TRUTH = load_parameters(7.0, np.array([1.0, 0, 0]) + OFFSET, INERTIA)
STATE = jffsr.State(np.array([0.3, -0.2, 0.5]), ATTITUDE, Q)


@pytest.fixture(scope="module")
def numbers():
    """Everything below in one program."""

    @jit
    def compute(r, acceleration, qdd):
        kin = jffsr.kinematics(ROBOT, STATE)
        motion = (SPIN, acceleration, QD, qdd, r)
        own = reference_torque(ROBOT, kin, spatial_inertias(ROBOT, kin), *motion)
        kin_loaded = jffsr.kinematics(LOADED, STATE)
        both = reference_torque(LOADED, kin_loaded, spatial_inertias(LOADED, kin_loaded), *motion)
        return own, both, load_regressor(ROBOT, kin, *motion)

    return compute


def test_the_loads_inertia_is_the_compounds_less_the_robots():
    kin, kin_loaded = jffsr.kinematics(ROBOT, STATE), jffsr.kinematics(LOADED, STATE)
    difference = spatial_inertias(LOADED, kin_loaded) - spatial_inertias(ROBOT, kin)
    np.testing.assert_allclose(load_inertias(ROBOT, kin, 3, TRUTH), difference, atol=1e-11)


def test_the_regressor_times_the_load_is_what_the_load_asks_for(numbers):
    own, both, regressor = numbers(R, ACCELERATION, QDD)
    np.testing.assert_allclose(regressor @ TRUTH, both - own, atol=1e-10)
    assert regressor.shape == (3, 10)
    # Nothing of the load goes unseen in general motion, but what only the first axis' direction could tell.
    assert np.linalg.matrix_rank(regressor) == 3


def test_with_no_error_it_is_the_equation_of_motion(numbers):
    """Torque that forward dynamics turns into these accelerations of base and joints."""
    torque = RNG.normal(size=3)
    twist = np.concatenate([[0.4, -0.3, 0.2], SPIN])
    found = jffsr.forward_dynamics(LOADED, jffsr.kinematics(LOADED, STATE), twist, QD, torque)
    _, both, _ = numbers(np.zeros(3), found[:6], found[6:])
    np.testing.assert_allclose(both, torque, atol=1e-10)


def joint_inertia(step: float) -> np.ndarray:
    """H_m a moment later; it does not depend on the base."""
    moved = jffsr.State(np.zeros(3), UPRIGHT, Q + step * QD)
    return np.asarray(jffsr.inertia_blocks(LOADED, jffsr.kinematics(LOADED, moved))[2])


def inertia_rate() -> np.ndarray:
    h = 1e-5
    return (joint_inertia(h) - joint_inertia(-h)) / (2 * h)


def test_the_skew_matrix(numbers):
    """r' (H_m' - 2 C_m) r = 0 for any r, while the base turns and accelerates."""
    _, with_error, _ = numbers(R, ACCELERATION, QDD)
    _, without, _ = numbers(np.zeros(3), ACCELERATION, QDD)
    c_r = np.asarray(with_error - without)
    np.testing.assert_allclose(R @ inertia_rate() @ R, 2 * R @ c_r, rtol=1e-8)


def test_the_energy_function_falls_as_the_proof_says(numbers):
    """V' = -r' K r, V's derivative put together from the true compound's acceleration under the law."""
    gains = Gains(np.array([3.0, 2.0, 1.0]), np.array([1.0, 2.0, 0.5]))
    estimate = np.asarray(TRUTH) + RNG.normal(size=10)
    adaptation = 0.5 + RNG.random(10)
    # With no smoothing and an infinitely small period the law is that of the proof.
    small = 1e-9
    controller = PassivityBased(
        ROBOT, gains, adaptation, estimate, bias_adaptation=0.0, smoothing=0.0, period=small
    )
    error = RNG.normal(size=3)
    error_rate = R - gains.slope * error
    desired = Desired(Q + error, QD + error_rate, QDD - gains.slope * error_rate)
    measured = Measured(ATTITUDE, SPIN, ACCELERATION, Q, QD, jnp.array(True))
    state, torque = jit(controller.advance)(controller.begin(measured), 0.0, measured, desired)
    # The joints' rows of the truth: H_m qdd = tau - H_bm' nudot - c_m.
    _, rest, _ = numbers(np.zeros(3), ACCELERATION, np.zeros(3))
    qdd = np.linalg.solve(joint_inertia(0.0), torque - rest)
    r_dot = QDD - qdd
    miss = np.asarray(TRUTH) - estimate
    estimate_rate = (np.asarray(state.parameters) - estimate) / small
    v_dot = R @ joint_inertia(0.0) @ r_dot + R @ inertia_rate() @ R / 2 - miss @ (estimate_rate / adaptation)
    h = np.asarray(jffsr.generalized_inertia(ROBOT, jffsr.kinematics(ROBOT, STATE)))
    root = np.sqrt(gains.rate)
    np.testing.assert_allclose(v_dot, -(root * R) @ h @ (root * R), rtol=1e-5)


def test_what_is_not_measured_teaches_nothing():
    controller = PassivityBased.of(ROBOT, start=np.asarray(TRUTH))
    lost = Measured(ATTITUDE, SPIN, ACCELERATION, Q, QD, jnp.array(False))
    desired = Desired(Q + 1.0, QD, QDD)
    begun = LoadEstimate(jnp.asarray(TRUTH), jnp.ones(3), jnp.zeros(6))
    state, torque = jit(controller.advance)(begun, 0.0, lost, desired)
    for name in ("parameters", "bias", "base_acceleration"):
        np.testing.assert_array_equal(getattr(state, name), getattr(begun, name))
    assert np.all(np.isfinite(torque))
    # It is the feedforward of what is desired.
    kin = jffsr.kinematics(LOADED, jffsr.State(np.zeros(3), ATTITUDE, Q + 1.0))
    expected = reference_torque(
        LOADED, kin, spatial_inertias(LOADED, kin), SPIN, jnp.zeros(6), QD, QDD, jnp.zeros(3)
    )
    np.testing.assert_allclose(torque, expected + 1.0, atol=1e-9)
