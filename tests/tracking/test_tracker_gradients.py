"""Derivatives where singular values are zero all along, joints saturate, and the base's attitude is held."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.robots.robot import Limits
from jffsr.tracking.indices import pose_errors
from jffsr.tracking.redundancy import ManipulabilityGradient
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track
from jffsr.trajectories.cartesian.interface import ToolTarget

MOMENTUM = jnp.array([0.3, -0.2, 0.0, 0.0, 0.0, 0.4])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Shift:
    """A tool that goes along a line from rest to rest and keeps its attitude."""

    start: jax.Array
    quaternion: jax.Array
    change: jax.Array
    duration: jax.Array

    def __call__(self, time):
        s = jnp.clip(time / self.duration, 0.0, 1.0)
        place, rate = s**2 * (3 - 2 * s), 6 * s * (1 - s) / self.duration
        twist = jnp.concatenate([rate * self.change, jnp.zeros(3)])
        return ToolTarget(self.start + place * self.change, self.quaternion, twist, jnp.zeros(6))


@pytest.fixture(scope="module")
def planar(robots):
    """Three joints in a plane: of three directions of position, one is never there."""
    robot = robots["ye_2019_planar3"]
    start = wu_path.state_at([0.5, 0.9, -0.7])
    position, quaternion = wu_path.tool_pose(robot, start)
    target = Shift(position, quaternion, jnp.array([-0.4, 0.3, 0.0]), jnp.array(4.0))
    held = robot.replace(limits=Limits.symmetric(3, velocity=0.16, acceleration=0.5))
    return held, start, target


@pytest.mark.slow
def test_gradients_at_zero_singular_values_and_saturated_joints(planar):
    robot, start, target = planar
    fixed = Tracker(
        freedom="position",
        limits="redistribute",
        secondary=(ManipulabilityGradient(0.02),),
        feedforward="instant",
    )

    def error(numbers):
        tracker = replace(fixed, lambda_max=numbers[0], epsilon=numbers[1], position_gain=numbers[2])
        heavier = robot.replace(mass=jnp.asarray(robot.mass) * jnp.array([numbers[3], 1.0, 1.0, 1.0]))
        found = track(heavier, target, start, tracker, 4.0, MOMENTUM)
        return jnp.sum(found.pose_error[:, :3] ** 2), found

    slope = jit(jax.value_and_grad(error, has_aux=True))
    numbers = jnp.array([0.3, 0.9, 0.5, 1.0])
    (_, tracked), found = slope(numbers)
    np.testing.assert_allclose(tracked.singular_values[:, 2], 0.0, atol=1e-15)
    assert np.any(tracked.limited)
    assert np.max(np.abs(tracked.motion.joint_velocity)) <= 0.16 * (1 + 1e-12)
    for axis in range(4):
        step = 1e-6 * jnp.eye(4)[axis]
        expected = (slope(numbers + step)[0][0] - slope(numbers - step)[0][0]) / 2e-6
        assert abs(float(expected)) > 1e-6
        np.testing.assert_allclose(found[axis], expected, rtol=1e-4)


def test_a_base_that_keeps_its_attitude(planar):
    robot, start, target = planar
    tracker = Tracker(freedom="position", substeps=5, position_gain=10.0, limits="ignore")
    found = jit(lambda: track(robot, target, start, tracker, 4.0, MOMENTUM, base_mode="attitude_held"))()
    np.testing.assert_array_equal(found.motion.base_quaternion, np.tile([1.0, 0, 0, 0], (81, 1)))
    assert float(pose_errors(found).position_end) < 1e-6
    # Only linear momentum is kept: the system's centre of mass goes straight on.
    centres = [
        wu_path.centre_of_mass(
            robot, wu_path.state_at(found.motion.joint_position[k], found.motion.base_position[k])
        )
        for k in (0, 40, 80)
    ]
    drift = np.asarray(MOMENTUM[:3]) / np.sum(robot.mass)
    for centre, time in zip(centres, (0.0, 2.0, 4.0), strict=True):
        np.testing.assert_allclose(centre - centres[0], drift * time, atol=1e-12)
