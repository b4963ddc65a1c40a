"""Both rollouts against motions that another program integrated to 2e-15, and against each other."""

from __future__ import annotations

from functools import partial

import chex
import jax
import numpy as np
import pytest
from motions import Quintic

from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.robots.state import State
from jffsr.rollouts.reference import reference_rollout
from jffsr.rollouts.rollout import rollout
from jffsr.spatial.rotation import quaternion_to_matrix

STEPS, SAMPLES = 400, 11
TOLERANCE = 1e-10


def _poses(integrate, robot, trajectory, state, momentum):
    """Motion, and at the oracle's stamps base pose, tool pose and system centre of mass."""
    motion = integrate(robot, trajectory, state, num_steps=STEPS, momentum=momentum)
    every = STEPS // (SAMPLES - 1)

    def at(position, quaternion, q):
        kin = kinematics(robot, State(position, quaternion, q))
        tool_position, tool_quaternion = end_effector_pose(robot, kin)
        return tool_position, quaternion_to_matrix(tool_quaternion), system_com(robot, kin)

    poses = (motion.base_position[::every], motion.base_quaternion[::every], motion.joint_position[::every])
    tool_position, tool_rotation, com = jax.vmap(at)(*poses)
    return motion, {
        "base_position": poses[0],
        "base_quaternion": poses[1],
        "tool_position": tool_position,
        "tool_rotation": tool_rotation,
        "system_com": com,
    }


@pytest.fixture(scope="module", params=["wu6", "planar2"])
def motions(request, oracles):
    """Per momentum and path: motion and poses; one compilation for each path and robot."""
    oracle = oracles[request.param]
    found = {}
    for name, path in (("fast", rollout), ("reference", reference_rollout)):
        run = jax.jit(partial(_poses, path))
        for key in ("rollout", "rollout_nonzero_momentum"):
            record = oracle.data[key]
            first = record["samples"][0]
            q0, qf = np.array(record["q0"]), np.array(record["qf"])
            found[key, name] = run(
                oracle.robot,
                Quintic(q0, qf, np.array(record["duration_s"])),
                State(np.array(first["base_position"]), np.array(first["base_quat_wxyz"]), q0),
                np.array(record["total_P"] + record["total_L_com"]),
            )
    return oracle.data, found


@pytest.mark.parametrize("path", ["fast", "reference"])
@pytest.mark.parametrize("key", ["rollout", "rollout_nonzero_momentum"])
def test_poses_agree_with_the_oracle(motions, key, path):
    data, found = motions
    motion, poses = found[key, path]
    samples = data[key]["samples"]
    tool = [sample["end_effectors"][0] for sample in samples]
    expected = {
        "base_position": np.array([s["base_position"] for s in samples]),
        "base_quaternion": np.array([s["base_quat_wxyz"] for s in samples]),
        "tool_position": np.array([t["position"] for t in tool]),
        "tool_rotation": np.array([t["R"] for t in tool]),
        "system_com": np.array([s["system_com"] for s in samples]),
    }
    quaternion = expected["base_quaternion"]
    quaternion *= np.sign(np.sum(quaternion * poses["base_quaternion"], axis=1, keepdims=True))
    every = STEPS // (SAMPLES - 1)
    for name, value in expected.items():
        np.testing.assert_allclose(poses[name], value, rtol=0, atol=TOLERANCE, err_msg=name)
    np.testing.assert_allclose(motion.time[::every], [s["t"] for s in samples], rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.joint_position[::every], [s["q"] for s in samples], rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.joint_velocity[::every], [s["qd"] for s in samples], rtol=0, atol=1e-13)


@pytest.mark.parametrize("key", ["rollout", "rollout_nonzero_momentum"])
def test_both_paths_give_the_same_motion(motions, key):
    _, found = motions
    (fast, _), (reference, _) = found[key, "fast"], found[key, "reference"]
    chex.assert_trees_all_equal_shapes(fast, reference)
    chex.assert_tree_all_finite(fast)
    chex.assert_trees_all_close(fast, reference, rtol=0, atol=2e-12)


def test_shapes(motions):
    data, found = motions
    motion, _ = found["rollout", "fast"]
    n = len(data["rollout"]["q0"])
    chex.assert_shape(motion.time, (STEPS + 1,))
    chex.assert_shape(motion.base_position, (STEPS + 1, 3))
    chex.assert_shape(motion.base_quaternion, (STEPS + 1, 4))
    chex.assert_shape(motion.base_twist, (STEPS + 1, 6))
    chex.assert_shape(
        [motion.joint_position, motion.joint_velocity, motion.joint_acceleration], (STEPS + 1, n)
    )
    chex.assert_shape(motion.momentum, (6,))
    chex.assert_shape(motion.joint_grid.time, (2 * STEPS + 1,))
    chex.assert_shape(motion.joint_grid.joint_position, (2 * STEPS + 1, n))
