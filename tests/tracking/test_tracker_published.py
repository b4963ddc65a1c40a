"""The published case of Wu et al. 2018, and derivatives through the whole rollout."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.tracking.indices import (
    PathError,
    PublishedIndex,
    peak_rate,
    pose_errors,
    published_error,
    published_index,
    rate_overrun,
)
from jffsr.tracking.inverses import singular_values
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track

PRINTED = Tracker(lambda_max=0.0571, epsilon=0.0677)
SAMPLES = 100


@pytest.fixture(scope="module")
def wu(robots):
    return robots["wu_2018_6dof"]


@pytest.fixture(scope="module")
def follow(wu):
    """Tracking of Wu's path in 100 samples; its tracker and its path are arguments."""
    start = wu_path.state_at(wu_path.START)
    return jit(lambda tracker, path: track(wu, path, start, tracker, num_samples=SAMPLES))


@pytest.fixture(scope="module")
def printed(wu, follow):
    return follow(PRINTED, wu_path.wu_path(wu, 25.0))


def test_start_of_the_published_path(wu, printed):
    position, _ = wu_path.tool_pose(wu, wu_path.state_at(wu_path.START))
    np.testing.assert_allclose(position, [1.3717, -0.0763, 0.6415], atol=5e-5)
    expected = [2.083897, 1.647927, 0.742469, 0.494872, 0.416870, 0.265554]
    np.testing.assert_allclose(printed.singular_values[0], expected, atol=1e-6)
    assert abs(float(printed.determinant[0]) + 0.139681) < 1e-6
    assert abs(float(printed.manipulability[0]) - 0.139681) < 1e-6


def test_tool_axes_meet_the_printed_attitude(wu):
    """The printed start attitude is within 4.4 mm and a degree of the tool's."""
    position, quaternion = wu_path.tool_pose(wu, wu_path.state_at(wu_path.START))
    goal, attitude = wu_path.PRINTED_START
    assert abs(np.linalg.norm(np.asarray(position) - goal) - 0.0044) < 1e-4
    between = np.abs(np.asarray(quaternion) @ np.asarray(wu_path.printed_quaternion(attitude)))
    assert 2 * np.rad2deg(np.arccos(between)) < 1.0


def test_determinant_vanishes_near_the_middle_of_15_seconds(wu, follow):
    tracked = follow(PRINTED, wu_path.wu_path(wu, 15.0))
    determinant, time = np.asarray(tracked.determinant), np.asarray(tracked.time)
    (before,) = np.flatnonzero(determinant[:-1] * determinant[1:] < 0)
    share = determinant[before] / (determinant[before] - determinant[before + 1])
    assert 7.2 < time[before] + share * (time[1] - time[0]) < 8.0


def test_published_peak_rate_and_index_at_25_seconds(printed):
    assert abs(np.rad2deg(float(peak_rate(printed))) - 5.99) < 0.005
    assert abs(float(published_index(printed)) - 0.00235) < 5e-6
    # B is that of the end: along the path it is larger.
    assert float(jnp.max(published_error(printed))) > 1.2 * 0.00235
    offset, turn = np.asarray(printed.pose_error[-1, :3]), np.asarray(printed.pose_error[-1, 3:])
    by_hand = 0.5 * np.sqrt(np.sum(offset**2)) + 0.5 * np.sqrt(np.sum((offset * turn) ** 2))
    assert abs(float(published_index(printed)) - by_hand) < 1e-15


def test_adaptive_damping_tracks_better_and_moves_faster_than_plain_damping(wu, follow, printed):
    start = wu_path.state_at(wu_path.START)
    damped = jit(lambda tracker, path: track(wu, path, start, tracker, num_samples=SAMPLES))(
        replace(PRINTED, method="damped", damping=0.0571), wu_path.wu_path(wu, 25.0)
    )
    for error in ("position_peak", "position_rms", "position_end"):
        assert getattr(pose_errors(printed), error) < getattr(pose_errors(damped), error)
    assert published_index(printed) < published_index(damped)
    assert peak_rate(printed) > peak_rate(damped)


def test_indices_say_what_they_measure(printed):
    errors = np.asarray(printed.pose_error)
    found = pose_errors(printed)
    assert abs(float(found.position_peak) - np.linalg.norm(errors[:, :3], axis=1).max()) < 1e-15
    assert abs(float(found.attitude_rms) - np.sqrt(np.mean(np.sum(errors[:, 3:] ** 2, axis=1)))) < 1e-15
    rates = np.abs(np.asarray(printed.motion.joint_velocity))
    limit = 0.7 * rates.max()
    expected = np.sum(np.maximum(rates.max(axis=0) / limit - 1, 0))
    assert expected > 0
    assert abs(float(rate_overrun(printed, limit)) - expected) < 1e-12
    for index in (PublishedIndex(limit), PathError(limit, peak_weight=0.5), PathError(2 * rates.max())):
        value = float(index.value(printed))
        assert abs(float(index.smooth(printed, 1e-3)) - value) < 1e-4 * value
        assert abs(float(index.smooth(printed, 1.0)) - value) < 0.1 * value
    still = replace(printed, pose_error=jnp.zeros_like(printed.pose_error))
    for index in (PublishedIndex(1.0), PathError(1.0, peak_weight=1.0)):
        slope = jax.grad(lambda e, i=index: i.smooth(replace(still, pose_error=e)))(still.pose_error)
        assert np.all(np.isfinite(slope))


def test_singular_values_and_errors_are_those_of_the_motion(wu, printed):
    """Read again from the sampled poses alone."""
    for k in (0, 37, 100):
        motion = printed.motion
        state = wu_path.state_at(motion.joint_position[k], motion.base_position[k], motion.base_quaternion[k])
        kin = kinematics(wu, state)
        np.testing.assert_allclose(
            singular_values(generalized_jacobian(wu, kin)), printed.singular_values[k], atol=1e-13
        )
        position, _ = wu_path.tool_pose(wu, state)
        np.testing.assert_allclose(
            position - wu_path.wu_path(wu, 25.0)(motion.time[k]).position,
            printed.pose_error[k, :3],
            atol=1e-13,
        )
