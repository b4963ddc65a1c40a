"""Constraints on a motion against SciPy's rotations, true peaks, and finite differences."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.objectives.constraints import (
    BaseExcursion,
    FinalAttitude,
    JointLimits,
    joint_limits,
    largest_violation,
)
from jffsr.objectives.terms import EULER_ZXY, ROTATION_VECTOR, attitude_angles

LIMITS = {
    "position_lower": np.array([-2.0, -3.0, -np.inf, -1.0, -4.0, -2.0]),
    "position_upper": np.array([3.0, 3.0, np.inf, 2.0, 1.0, 2.5]),
    "velocity": np.array([0.5, 1.0, 1.5, 2.0, 2.5, np.inf]),
    "acceleration": np.array([np.inf, 0.7, 1.4, 3.0, 0.2, 1.1]),
}


def quaternion(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1)


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.3, 3.0])
def test_final_attitude_is_the_rotation_vector_from_the_goal(make_motion, size):
    goal = Rotation.from_rotvec([0.4, -1.0, 2.0])
    vector = size * np.array([0.6, 0.0, -0.8])
    end = quaternion(goal * Rotation.from_rotvec(vector))
    motion = make_motion(np.array([[1.0, 0, 0, 0], [1.0, 0, 0, 0], -end]))
    constraint = FinalAttitude(quaternion(goal))
    np.testing.assert_allclose(constraint.equality(None, motion), vector, atol=1e-15)
    assert constraint.inequality(None, motion).shape == (0,)
    assert largest_violation(constraint, None, motion) == pytest.approx(0.8 * size, abs=1e-15)


def test_final_attitude_in_the_plane_has_two_idle_numbers_with_finite_gradients(make_motion):
    constraint = FinalAttitude(np.array([np.cos(0.2), 0, 0, np.sin(0.2)]))

    def errors(angle):
        end = jnp.stack([jnp.cos(angle / 2), 0.0, 0.0, jnp.sin(angle / 2)])
        start = jnp.array([1.0, 0, 0, 0])
        motion = replace(make_motion(np.eye(4)[[0, 0]]), base_quaternion=jnp.stack([start, end]))
        return constraint.equality(None, motion)

    for angle in (0.4, 0.1, -1.0):
        np.testing.assert_allclose(errors(angle), [0, 0, angle - 0.4], atol=1e-15)
        np.testing.assert_allclose(jax.jacfwd(errors)(angle), [0, 0, 1], atol=1e-14)


def true_overruns(motion) -> np.ndarray:
    """One number a joint and quantity, by the definition."""
    grid, lower, upper = motion.joint_grid, LIMITS["position_lower"], LIMITS["position_upper"]
    beyond = np.maximum(grid.joint_position - upper, lower - grid.joint_position).max(axis=0)
    finite = np.isfinite(lower)
    position = np.where(finite, beyond / np.where(finite, (upper - lower) / 2, 1.0), -1.0)
    rate = np.abs(grid.joint_velocity).max(axis=0) / LIMITS["velocity"] - 1
    acceleration = np.abs(grid.joint_acceleration).max(axis=0) / LIMITS["acceleration"] - 1
    return np.concatenate([position, rate, acceleration])


def test_joint_limits_are_never_below_the_true_peaks(tumbling):
    constraint = JointLimits(**LIMITS)
    found, expected = constraint.inequality(None, tumbling), true_overruns(tumbling)
    above = np.asarray(found) - expected
    count = 2 * len(tumbling.joint_grid.time)
    assert found.shape == (18,)
    assert np.all(above >= -1e-14)
    assert np.all(above <= 5e-4 * np.log(count) + 1e-15)
    narrow = replace(constraint, width=1e-9).inequality(None, tumbling)
    np.testing.assert_allclose(narrow, expected, atol=1e-7)
    assert largest_violation(constraint, None, tumbling) == np.max(found) > 0
    assert constraint.equality(None, tumbling).shape == (0,)


def test_joint_limits_may_leave_quantities_out(tumbling, robots):
    whole = JointLimits(**LIMITS).inequality(None, tumbling)
    only = JointLimits(velocity=LIMITS["velocity"]).inequality(None, tumbling)
    np.testing.assert_array_equal(only, whole[6:12])
    robot = robots["wu_2018_6dof"]
    robot = robot.replace(limits=replace(robot.limits, **LIMITS))
    np.testing.assert_array_equal(joint_limits(robot).inequality(None, tumbling), whole)
    np.testing.assert_array_equal(
        joint_limits(robot, ["acceleration"]).inequality(None, tumbling), whole[12:]
    )
    assert joint_limits(robot, []).inequality(None, tumbling).shape == (0,)


def test_joint_limits_have_finite_gradients_at_rest_and_ties(make_motion):
    """All joints still: every sample is the peak, on both sides."""
    still = make_motion(np.eye(4)[[0] * 4], np.zeros((7, 6)), np.zeros((7, 6)), np.zeros((7, 6)))

    def total(rates):
        moved = replace(still, joint_grid=replace(still.joint_grid, joint_velocity=rates))
        return jnp.sum(JointLimits(**LIMITS).inequality(None, moved))

    gradient = jax.grad(total)(jnp.zeros((7, 6)))
    np.testing.assert_array_equal(gradient, 0.0)


@pytest.mark.parametrize("measure", [ROTATION_VECTOR, EULER_ZXY])
def test_base_excursion(tumbling, measure):
    limit = np.array([0.1, 0.25, np.inf])
    constraint = BaseExcursion(limit, width=1e-9, measure=measure)
    expected = np.abs(np.asarray(attitude_angles(tumbling, measure))).max(axis=0) / limit - 1
    np.testing.assert_allclose(constraint.inequality(None, tumbling), expected, atol=1e-7)
    assert constraint.equality(None, tumbling).shape == (0,)
