"""The generalized Jacobian by a second route, and its published values for the arm of Wu et al. 2018."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.errors import InputError
from jffsr.robots.state import State

HOME_DEG = np.array([175.0, -60, -60, 0, 210, 5])


def _from_the_tool(robot, kin, tool, body):
    """-I_E^-1 I_M of Li 2022, eqs. (23)-(25) with the sign corrected, as sums over the bodies.

    The tool is the reference: a body's velocity is that of the tool's rigid extension plus what the joints
    add between the tool and the body. A joint counts +1 for the bodies beyond it as seen from the base, and
    once less if the tool is beyond it too.
    """
    support = robot.topology.support.astype(float)
    tool_inertia, joint_inertia = np.zeros((6, 6)), np.zeros((6, robot.num_joints))
    for i, mass in enumerate(robot.mass):
        lever = kin.com[i] - tool
        inertia = kin.rotation[i] @ robot.inertia[i] @ kin.rotation[i].T
        along = np.zeros((6, robot.num_joints))
        for j, revolute in enumerate(robot.topology.is_revolute):
            share, axis = support[i, j] - support[body, j], kin.axis[j]
            if revolute:
                along[:, j] = share * np.concatenate([np.cross(axis, kin.com[i] - kin.anchor[j]), axis])
            else:
                along[:3, j] = share * axis
        extension = np.eye(6)
        for k, unit in enumerate(np.eye(3)):
            extension[:3, 3 + k] = np.cross(unit, lever)
        for columns, total in ((extension, tool_inertia), (along, joint_inertia)):
            for k in range(columns.shape[1]):
                linear = mass * columns[:3, k]
                total[:3, k] += linear
                total[3:, k] += inertia @ columns[3:, k] + np.cross(lever, linear)
    return -np.linalg.solve(tool_inertia, joint_inertia)


@pytest.mark.parametrize(
    ("name", "tool"),
    [("wu_2018_6dof", "tool"), ("servicer_7dof", "tool"), ("two_arms", "left"), ("two_arms", "right")],
)
def test_the_route_from_the_tool_gives_the_same_matrix(robots, name, tool):
    robot = robots[name]
    index = robot.end_effector_index(tool)

    @jax.jit
    def ours(robot, state):
        kin = kinematics(robot, state)
        return kin, end_effector_pose(robot, kin, tool)[0], generalized_jacobian(robot, kin, tool)

    rng = np.random.default_rng(2)
    for _ in range(4):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        state = State(rng.normal(size=3), quaternion, rng.uniform(-2, 2, robot.num_joints))
        kin, position, matrix = jax.tree.map(np.asarray, ours(robot, state))
        chex.assert_shape(matrix, (6, robot.num_joints))
        expected = _from_the_tool(robot, kin, position, robot.topology.end_effector_bodies[index])
        np.testing.assert_allclose(matrix, expected, rtol=0, atol=1e-12)


def test_wu_home_posture(robots):
    """Tool position as the paper prints it, singular values and determinant as computed independently."""
    robot = robots["wu_2018_6dof"]

    @jax.jit
    def home(robot, q):
        kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), q))
        return end_effector_pose(robot, kin)[0], generalized_jacobian(robot, kin)

    position, matrix = home(robot, np.deg2rad(HOME_DEG))
    np.testing.assert_allclose(position, [1.3717, -0.0763, 0.6415], rtol=0, atol=5e-5)
    np.testing.assert_allclose(
        np.linalg.svd(matrix, compute_uv=False),
        [2.083897, 1.647927, 0.742469, 0.494872, 0.416870, 0.265554],
        rtol=0,
        atol=5e-7,
    )
    np.testing.assert_allclose(np.linalg.det(matrix), -0.139681, rtol=0, atol=5e-7)


def test_servicer_start_posture(robots):
    """The tool stands where Wang et al. 2021 print it, with the base's attitude."""
    robot = robots["servicer_7dof"]
    q = jnp.deg2rad(jnp.array([0.0, -60, 0, 45, 0, -15, 0]))
    kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), q))
    position, quaternion = end_effector_pose(robot, kin)
    np.testing.assert_allclose(position, [1.078, 0.252, -1.853], rtol=0, atol=1e-9)
    np.testing.assert_allclose(quaternion, [1, 0, 0, 0], rtol=0, atol=1e-12)


def test_an_unknown_end_effector_is_refused_by_name(robots):
    with pytest.raises(InputError, match=r"has no end effector 'hand'; it has \['left', 'right'\]"):
        robots["two_arms"].end_effector_index("hand")
