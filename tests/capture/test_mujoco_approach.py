"""An approach by torques in MuJoCo: the motion that our rollout and the free target's own equations say."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.capture.mujoco_approach import approach
from jffsr.robots.geometry import Geometry, Shape

DURATION, SAMPLES = 1.0, 10
CUBE = Geometry((Shape("cube", "box", "cube", np.zeros(3), np.eye(3), np.full(3, 0.2)),))
START = np.deg2rad([175.0, -60, -60, 10, 210, 5])


@pytest.fixture(scope="module")
def scene(robots):
    robot = robots["wu_2018_6dof"]
    law = jffsr.SinePolynomial.between(START, START + 0.3, [-7.0] * 6, [7.0] * 6, DURATION)
    turned = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_quat(scalar_first=True)
    state = jffsr.State(np.array([0.1, -0.2, 0.3]), turned, START)
    target = jffsr.Target.create([3.0, 4.0, 6.0], 60.0, geometry=CUBE)
    return robot, law, state, target, jffsr.ClearanceModel.create(robot, CUBE)


def target_state(position):
    quaternion = Rotation.from_rotvec([0.4, 0.2, -0.3]).as_quat(scalar_first=True)
    return jffsr.TargetState.create(position, [0.02, -0.01, 0.03], quaternion, [0.1, -0.3, 0.2])


def test_robot_and_target_move_as_our_equations_say(scene):
    robot, law, state, target, model = scene
    begin = target_state([5.0, 4.0, 3.0])
    found = approach(robot, law, state, model, target, begin, DURATION, samples=SAMPLES, step=5e-4)
    assert found.contacts == ()
    assert found.tracking < 1e-6
    assert found.joint_torque.shape == (SAMPLES, 6)
    motion = jffsr.rollout(robot, law, state, DURATION, 400)
    ours = np.asarray(motion.base_quaternion)[::40]
    np.testing.assert_allclose(np.abs(np.sum(ours * found.states.base_quaternion, axis=1)), 1.0, atol=1e-10)
    for name in ("base_position", "joint_position", "joint_velocity", "base_twist"):
        expected = np.asarray(getattr(motion, name))[::40]
        np.testing.assert_allclose(getattr(found.states, name), expected, atol=2e-6)
    free = jax.device_get(jax.vmap(jffsr.target_motion(target, begin, DURATION))(found.time))
    for name in ("position", "velocity", "angular_velocity_T"):
        np.testing.assert_allclose(getattr(found.target_states, name), getattr(free, name), atol=1e-8)
    last, last_target = found.end
    np.testing.assert_array_equal(last.joint_velocity, found.states.joint_velocity[-1])
    np.testing.assert_array_equal(last_target.quaternion, found.target_states.quaternion[-1])


def test_a_target_in_the_way_is_told(scene):
    robot, law, state, target, model = scene
    found = approach(robot, law, state, model, target, target_state(state.base_position), 0.01, samples=1)
    assert found.contacts
    assert found.contacts[0].time == 0.0
    assert "target" in found.contacts[0].pair
