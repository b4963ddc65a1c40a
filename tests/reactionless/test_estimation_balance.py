"""The momentum balance of robot and load, its linear form, and the ten numbers of a load."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.reactionless.estimation.balance import Load, balance_of, load_blocks
from jffsr.reactionless.estimation.pseudo_inertia import load_from_parameters, parameters_from_load
from jffsr.reactionless.estimation.reduced_moments import moment_regressor, reduced_moments
from jffsr.reactionless.interface import Measured
from jffsr.reactionless.null_space import reaction_blocks

ROBOT = jffsr.load_robot("servicer_7dof")
INERTIA = np.array([[2.0, 0.1, -0.2], [0.1, 2.5, 0.3], [-0.2, 0.3, 1.8]])
LOAD = Load(np.array(60.0), np.array([0.3, -0.1, 0.2]), INERTIA)


@pytest.fixture(scope="module")
def case():
    """A random motion of robot and load; everything that the tests compare, in one program."""
    rng = np.random.default_rng(4)
    base = Rotation.random(rng=rng).as_quat(scalar_first=True)
    state = jffsr.State(rng.normal(size=3), base, rng.normal(size=7), rng.normal(size=6), rng.normal(size=7))
    whole = jffsr.weld(
        ROBOT, jffsr.RigidBody(60.0, np.zeros(3), INERTIA), position=LOAD.com, quaternion=(1, 0, 0, 0)
    )
    measured = Measured(
        state.base_quaternion,
        state.base_twist[3:],
        np.zeros(6),
        state.joint_position,
        state.joint_velocity,
        True,
    )

    @jax.jit
    def found(state, measured):
        kin = jffsr.kinematics(whole, state)
        balance = balance_of(ROBOT, measured)
        return {
            "momentum": jffsr.momentum(whole, kin, state.base_twist, state.joint_velocity)[3:],
            "blocks": reaction_blocks(whole, kin),
            "balance": balance,
            "load": load_blocks(balance, LOAD),
            "own": balance.own_momentum,
            "linear": moment_regressor(balance),
            "moments": reduced_moments(LOAD, balance.robot_mass),
        }

    return state, found(state, measured)


def test_the_balance_holds_without_the_bases_linear_velocity(case):
    """d = L - dH_w w_0 - dH_wphi qd, L being the momentum of the welded whole, which moves."""
    state, found = case
    balance, (locked, coupling) = found["balance"], found["load"]
    momentum = balance.rotation.T @ found["momentum"]
    expected = momentum - locked @ balance.base_rate - coupling @ balance.joint_velocity
    np.testing.assert_allclose(found["own"], expected, atol=1e-10)
    turned = Rotation.from_quat(state.base_quaternion, scalar_first=True).as_matrix()
    np.testing.assert_allclose(balance.rotation, turned, atol=1e-14)


def test_robot_and_load_are_the_welded_whole(case):
    _, found = case
    balance, rotation = found["balance"], np.asarray(found["balance"].rotation)
    locked, coupling = found["blocks"]
    np.testing.assert_allclose(balance.locked + found["load"][0], rotation.T @ locked @ rotation, atol=1e-10)
    np.testing.assert_allclose(balance.coupling + found["load"][1], rotation.T @ coupling, atol=1e-10)


def test_the_balance_is_linear_in_the_reduced_moments(case):
    _, found = case
    constants = np.concatenate([found["moments"], found["momentum"]])
    np.testing.assert_allclose(found["linear"] @ constants, found["own"], atol=1e-10)
    mass = float(np.sum(ROBOT.mass))
    np.testing.assert_allclose(found["moments"][0], 60.0 * mass / (60.0 + mass), rtol=1e-14)


def test_what_is_not_finite_is_not_usable():
    lost = Measured(
        np.array([1.0, 0, 0, 0]), np.array([0, np.nan, 0]), np.zeros(6), np.zeros(7), np.zeros(7), True
    )
    balance = jax.jit(balance_of)(ROBOT, lost)
    assert not balance.usable
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(balance))


def test_ten_numbers_are_a_load_and_back():
    again = load_from_parameters(parameters_from_load(LOAD))
    for name in ("mass", "com", "inertia"):
        np.testing.assert_allclose(getattr(again, name), getattr(LOAD, name), rtol=1e-12, atol=1e-13)


def test_the_load_of_any_numbers_is_a_rigid_body():
    """Its pseudo-inertia U U' is that of its mass, first moment and second moments about the origin."""
    rng = np.random.default_rng(2)
    for numbers in 1.5 * rng.normal(size=(20, 10)):
        load = jax.tree.map(np.asarray, load_from_parameters(jnp.asarray(numbers)))
        moments = np.linalg.eigvalsh(load.inertia)
        assert load.mass > 0
        assert moments[0] > 0
        assert moments[2] < moments[0] + moments[1]
        a, d1, d2, d3, s12, s23, s13, *t = numbers
        upper = np.exp(a) * np.array(
            [[np.exp(d1), s12, s13, t[0]], [0, np.exp(d2), s23, t[1]], [0, 0, np.exp(d3), t[2]], [0, 0, 0, 1]]
        )
        pseudo = upper @ upper.T
        np.testing.assert_allclose(pseudo[3, 3], load.mass, rtol=1e-12)
        np.testing.assert_allclose(pseudo[:3, 3], load.mass * load.com, rtol=1e-12, atol=1e-12)
        about_com = pseudo[:3, :3] - load.mass * np.outer(load.com, load.com)
        np.testing.assert_allclose(
            load.inertia, np.trace(about_com) * np.eye(3) - about_com, rtol=1e-9, atol=1e-9
        )
