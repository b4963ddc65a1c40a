"""Terms of joint torques on made-up curves: closed forms, quadrature's order, smooth forms, limits, gradients."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hu_problems import hu_problem
from scipy.spatial.transform import Rotation

from jffsr.compiling import ONCE
from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import JointPosition
from jffsr.objectives.torque_terms import (
    AttitudePenalty,
    JointTorque,
    MechanicalWork,
    PeakTorque,
    TorqueEnergy,
    TorqueIntegral,
    TorqueLimit,
    integral,
    simpson_weights,
)
from jffsr.robots.loading import load_robot

ONE = np.array(1.0)
SHARP = Smoothing(norm=1e-7, peak=1e-6, overrun=1e-7)
ROBOT = None  # every motion here carries its torques, so that no term looks at the robot


@pytest.fixture(scope="module")
def make(make_motion):
    """A motion of so many steps over 1 s with joint torques and rates given as functions of time."""

    def made(num_steps, *curves, rates=None):
        motion = make_motion(np.tile([1.0, 0, 0, 0], (num_steps + 1, 1)))
        torque = np.stack([curve(motion.time) for curve in curves], axis=1)
        speed = np.ones_like(torque) if rates is None else np.stack([r(motion.time) for r in rates], axis=1)
        return replace(
            motion, joint_torque=torque, joint_velocity=speed, joint_position=np.zeros_like(torque)
        )

    return made


def swing(t):
    return 3 * np.sin(2 * np.pi * t)


def push(t):
    return 2 - t


def test_integrals_and_peak_are_the_closed_forms(make):
    motion = make(400, swing, push)
    for term, expected in (
        (TorqueIntegral(ONE), 3 * 2 / np.pi + 1.5),
        (TorqueEnergy(ONE), 9 / 2 + 7 / 3),
        (MechanicalWork(ONE), 3 * 2 / np.pi + 1.5),
        (PeakTorque(ONE), 3.0),
    ):
        np.testing.assert_allclose(term.value(ROBOT, motion), expected, rtol=0, atol=2e-4)
    braking = make(400, push, rates=[lambda t: -t])
    np.testing.assert_allclose(MechanicalWork(ONE).value(ROBOT, braking), 1 - 1 / 3, rtol=0, atol=1e-12)


@pytest.mark.parametrize("steps", [1, 2, 3, 4, 5, 7, 10])
def test_quadrature_is_exact_for_cubics_and_sums_to_one(steps):
    t = np.linspace(0, 1, steps + 1)
    weights = simpson_weights(steps)
    np.testing.assert_allclose(weights.sum(), 1, rtol=0, atol=1e-14)
    order = 1 if steps == 1 else 3
    np.testing.assert_allclose(weights @ t**order, 1 / (order + 1), rtol=0, atol=1e-14)


@pytest.mark.parametrize("odd", [0, 1])
def test_quadrature_converges_at_order_four(make, odd):
    exact = (1 - np.exp(-2)) / 2
    errors = [
        abs(float(integral(motion, jnp.asarray(np.exp(-2 * motion.time)))) - exact)
        for motion in (make(n, push) for n in (64 + odd, 128 + odd))
    ]
    order = np.log(errors[0] / errors[1]) / np.log((128 + odd) / (64 + odd))
    assert 3.8 < order < 4.3


def test_smooth_forms_tend_to_the_values(make):
    motion = make(100, swing, push)
    limit = np.array([2.0, 1.9])
    for term in (
        TorqueIntegral(ONE),
        TorqueEnergy(ONE),
        MechanicalWork(ONE),
        PeakTorque(ONE),
        JointTorque(ONE, limit),
    ):
        value = term.value(ROBOT, motion)
        np.testing.assert_allclose(term.smooth(ROBOT, motion, SHARP), value, rtol=0, atol=3e-5)
        rounded = term.smooth(ROBOT, motion, Smoothing())
        assert abs(rounded - value) <= 0.5 + 1e-12


def test_overrun_of_torque_limits(make):
    motion = make(100, swing, push)
    term = JointTorque(ONE, np.array([2.0, 4.0]))
    np.testing.assert_allclose(term.value(ROBOT, motion), 0.5, rtol=0, atol=1e-12)
    none = JointTorque(ONE, np.full(2, np.inf))
    assert none.value(ROBOT, motion) == 0
    assert abs(none.smooth(ROBOT, motion, Smoothing())) < 1e-12


def test_the_torque_limit_is_kept_where_the_constraint_says_so(make):
    motion = make(100, swing, push)
    assert TorqueLimit(np.array([4.0, 4.0])).equality(ROBOT, motion).shape == (0,)
    kept = TorqueLimit(np.array([3.05, np.inf])).inequality(ROBOT, motion)
    assert kept.shape == (2,)
    assert np.all(kept <= 0)
    missed = TorqueLimit(np.array([2.0, 4.0])).inequality(ROBOT, motion)
    # Never below the peak, and above it by no more than the width times the logarithm of the number of samples.
    assert 0.5 <= missed[0] <= 0.5 + 5e-4 * np.log(202)
    np.testing.assert_allclose(missed[1], -0.5, rtol=0, atol=6e-3)


def test_the_attitude_penalty_is_the_squared_angle(make_motion):
    for angle in (0.0, 1e-5, 0.7, 3.0):
        turn = Rotation.from_rotvec(angle * np.array([0.6, 0, 0.8]))
        start = Rotation.from_rotvec([0.3, -0.5, 0.1])
        final = np.roll((start * turn).as_quat(), 1)
        motion = make_motion(np.stack([np.roll(start.as_quat(), 1), final]))
        term = AttitudePenalty(ONE, np.roll(start.as_quat(), 1))
        np.testing.assert_allclose(term.value(ROBOT, motion), angle**2, rtol=1e-9, atol=1e-30)
        np.testing.assert_allclose(term.smooth(ROBOT, motion, SHARP), angle**2, rtol=1e-4, atol=1e-11)


def test_the_overrun_of_positions_is_relative_to_half_the_range(make_motion):
    q = np.zeros((5, 4))
    q[2] = [3.5, -2.0, 9.0, -8.0]
    q[3] = [0.5, 1.0, -9.0, 7.0]
    motion = make_motion(np.tile([1.0, 0, 0, 0], (3, 1)), joint_position=q)
    lower, upper = np.array([0.0, -1.0, -np.inf, -6.0]), np.array([3.0, 3.0, np.inf, np.inf])
    term = JointPosition(ONE, lower, upper)
    expected = 0.5 / 1.5 + 1.0 / 2.0 + 0.0 + 2.0
    np.testing.assert_allclose(term.value(ROBOT, motion), expected, rtol=1e-14)
    np.testing.assert_allclose(term.smooth(ROBOT, motion, SHARP), expected, rtol=0, atol=2e-5)

    def smooth(q):
        grid = replace(motion.joint_grid, joint_position=q)
        return term.smooth(ROBOT, replace(motion, joint_grid=grid), Smoothing())

    gradient = jax.jit(jax.grad(smooth))(jnp.asarray(q))
    chex.assert_tree_all_finite(gradient)
    np.testing.assert_allclose(gradient.sum(axis=0), [1 / 1.5, -0.5, 0, -1], rtol=0, atol=1e-6)


@pytest.mark.slow
def test_gradients_of_all_terms_through_a_motion_are_the_differences():
    """Of the smooth index of the planar arm with every term, at random points and at the straight quintic."""
    robot = load_robot("hu_2011_planar2")
    plain = hu_problem(robot, degree=7, num_steps=20, alpha=10.0)
    extra = (
        TorqueEnergy(ONE),
        MechanicalWork(ONE),
        PeakTorque(ONE),
        JointTorque(ONE, np.array([5.0, 3.0])),
        JointPosition(ONE, np.array([-1.2, -np.inf]), np.array([1.5, 1.4])),
    )
    index = CompositeIndex(plain.objective.terms + extra)
    assert index.needs_torque
    problem = replace(plain, objective=index)
    smooth_and_gradient = jax.value_and_grad(lambda z: problem.smooth_and_value(z)[0])
    values_and_gradients = jax.jit(jax.vmap(smooth_and_gradient), compiler_options=ONCE)
    h, rng = 1e-4, np.random.default_rng(2)
    points = np.concatenate([np.zeros((1, 4)), rng.uniform(-1, 1, (3, 4))])
    steps = np.concatenate([sign * k * h * np.eye(4) for k in (1, 2) for sign in (1, -1)])
    around = (points[:, None] + np.concatenate([np.zeros((1, 4)), steps])).reshape(-1, 4)
    values, gradients = (np.asarray(x) for x in values_and_gradients(around))
    chex.assert_tree_all_finite(gradients)
    values = values.reshape(4, 17)[:, 1:].reshape(4, 2, 2, 4)
    slope = 8 * (values[:, 0, 0] - values[:, 0, 1]) - (values[:, 1, 0] - values[:, 1, 1])
    gradients = gradients.reshape(4, 17, 4)[:, 0]
    np.testing.assert_allclose(gradients, slope / (12 * h), rtol=2e-6, atol=2e-6)
