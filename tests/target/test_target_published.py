"""The target of Wang, Luo and Yu (2021), as recovered: its grasp frame at 31.4 s beside the printed one."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from jffsr.target.body import Target
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import steps_needed, target_motion

TIME = 31.4
RATE = np.deg2rad([8.594, 2.865, 0.0])


@pytest.fixture(scope="module")
def grasped():
    """Position, quaternion and twist of the grasp frame at 31.4 s."""
    half = np.sqrt(0.5)
    target = Target.create(
        (0.654, 0.950, 1.0), grasps={"grasp": ((-0.351, 0.008, -0.428), (half, -half, 0.0, 0.0))}
    )
    start = TargetState.create((2.4, 0.0, -0.5), (0.0, 0.0, 0.0), (half, half, 0.0, 0.0), RATE)
    steps = steps_needed(target.inertia, start.angular_velocity_T, TIME)
    return jax.jit(lambda: grasp_frame(target, target_motion(target, start, TIME, steps)(TIME)))()


def test_position_and_velocity_to_the_printed_digits(grasped):
    position, _, twist = grasped
    np.testing.assert_allclose(position, [2.489, 0.197, -1.010], atol=1.1e-3)
    np.testing.assert_allclose(twist[:3], [-0.013, 0.075, 0.027], atol=6e-4)


def test_rate_and_attitude_within_what_was_recovered(grasped):
    _, quaternion, twist = grasped
    np.testing.assert_allclose(twist[3:], [0.132, -0.008, 0.086], atol=7e-4)
    printed = np.array([0.761, -0.498, -0.294, -0.294])
    cosine = abs(np.asarray(quaternion) @ printed) / np.linalg.norm(printed)
    assert np.rad2deg(2 * np.arccos(min(cosine, 1.0))) < 0.87
