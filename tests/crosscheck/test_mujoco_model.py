"""MuJoCo's inertia matrix, poses, momentum and bias force are ours, for every robot of the catalogue."""

from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

import jffsr
from jffsr.crosscheck.mujoco_model import to_mjmodel, to_mjspec
from jffsr.errors import InputError

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"

# A planar arm, a long one, two arms, and a tree that slides; the others have nothing that these lack.
NOW = {"hu_2011_planar2", "canadarm2_7dof", "dual_arm_servicer", str(TREE)}
ROBOTS = [
    pytest.param(name, marks=[] if name in NOW else [pytest.mark.slow])
    for name in (*jffsr.list_robots(), str(TREE))
]


class Setting:
    """One random state of a robot, in our terms and in MuJoCo's."""

    def __init__(self, name: str):
        rng = np.random.default_rng(7)
        self.robot = jffsr.load_robot(name)
        n = self.robot.num_joints
        quaternion = rng.normal(size=4)
        self.state = jffsr.State(
            rng.normal(size=3), quaternion / np.linalg.norm(quaternion), rng.normal(size=n)
        )
        self.twist, self.rate = rng.normal(size=6), rng.normal(size=n)
        self.kin = jffsr.kinematics(self.robot, self.state)
        self.rotation = np.asarray(self.kin.rotation[0])
        self.model = to_mjmodel(self.robot, 1e-3)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = np.concatenate(
            [self.state.base_position, self.state.base_quaternion, self.state.joint_position]
        )
        self.data.qvel[:] = np.concatenate([self.twist[:3], self.rotation.T @ self.twist[3:], self.rate])
        mujoco.mj_forward(self.model, self.data)

    def to_ours(self) -> np.ndarray:
        """The matrix that turns MuJoCo's velocity into [v_0; w_0; qd] in I."""
        matrix = np.eye(self.model.nv)
        matrix[3:6, 3:6] = self.rotation
        return matrix

    def our_inertia(self) -> np.ndarray:
        h_b, h_bm, h_m = (np.asarray(x) for x in jffsr.inertia_blocks(self.robot, self.kin))
        return np.block([[h_b, h_bm], [h_bm.T, h_m]])


@pytest.fixture(scope="module", params=ROBOTS)
def setting(request):
    return Setting(request.param)


def rounding(values: np.ndarray) -> float:
    """1e-10, and what double precision leaves open in a base of a hundred tonnes."""
    return 1e-10 + 4e-15 * np.abs(values).max()


def test_inertia_matrix(setting):
    theirs = np.zeros((setting.model.nv, setting.model.nv))
    mujoco.mj_fullM(setting.model, setting.data, theirs)
    turn = setting.to_ours()
    ours = turn.T @ setting.our_inertia() @ turn
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=rounding(theirs))


def test_poses_and_end_effectors(setting):
    np.testing.assert_allclose(setting.data.xipos[1:], setting.kin.com, rtol=0, atol=1e-12)
    for k, name in enumerate(setting.robot.end_effector_names):
        position, quaternion = jffsr.end_effector_pose(setting.robot, setting.kin, name)
        theirs = np.zeros(4)
        mujoco.mju_mat2Quat(theirs, setting.data.site_xmat[k])
        np.testing.assert_allclose(setting.data.site_xpos[k], position, rtol=0, atol=1e-12)
        np.testing.assert_allclose(abs(theirs @ np.asarray(quaternion)), 1.0, rtol=0, atol=1e-12)


def test_momentum(setting):
    mujoco.mj_subtreeVel(setting.model, setting.data)
    linear = setting.model.body_subtreemass[1] * setting.data.subtree_linvel[1]
    theirs = np.concatenate([linear, setting.data.subtree_angmom[1]])
    ours = jffsr.momentum(setting.robot, setting.kin, setting.twist, setting.rate)
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=rounding(theirs))


def test_bias_force(setting):
    """Bias by d'Alembert: the bodies' inertial forces at zero acceleration of the generalized velocity.

    Zero acceleration is MuJoCo's: of the linear velocity in I, of the angular velocity in B, of the joints.
    """
    robot, state, turn = setting.robot, setting.state, setting.to_ours()

    def jacobians(q, quaternion, position):
        kin = jffsr.kinematics(robot, jffsr.State(position, quaternion, q))
        lever = kin.com - kin.base_position
        bodies = len(robot.body_names)
        eye, zero = jnp.broadcast_to(jnp.eye(3), (bodies, 3, 3)), jnp.zeros((bodies, 3, 3))
        # Column k of the middle block is e_k x lever.
        turning = jnp.swapaxes(jnp.cross(jnp.eye(3)[None], lever[:, None, :]), 1, 2)
        linear = jnp.concatenate([eye, turning, kin.com_jacobian], axis=2)
        angular = jnp.concatenate([zero, eye, kin.angular_jacobian], axis=2)
        rotation = kin.rotation[0]
        turned = jnp.eye(6 + robot.num_joints).at[3:6, 3:6].set(rotation)
        return linear @ turned, angular @ turned, kin.inertia_I

    w = setting.twist[3:]
    spin = np.concatenate([[0.0], w])
    a, b = spin, np.asarray(state.base_quaternion)
    quaternion_rate = 0.5 * np.concatenate(
        [[a[0] * b[0] - a[1:] @ b[1:]], a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]
    )
    now = (jnp.asarray(state.joint_position), jnp.asarray(b), jnp.asarray(state.base_position))
    rates = (jnp.asarray(setting.rate), jnp.asarray(quaternion_rate), jnp.asarray(setting.twist[:3]))
    (linear, angular, inertia), (linear_rate, angular_rate, _) = jax.jvp(jacobians, now, rates)
    velocity = np.linalg.solve(turn, np.concatenate([setting.twist, setting.rate]))
    omega = np.asarray(angular @ velocity)
    force = robot.mass[:, None] * np.asarray(linear_rate @ velocity)
    moment = np.einsum("bij,bj->bi", inertia, angular_rate @ velocity)
    moment = moment + np.cross(omega, np.einsum("bij,bj->bi", inertia, omega))
    ours = np.einsum("bij,bi->j", linear, force) + np.einsum("bij,bi->j", angular, moment)
    np.testing.assert_allclose(setting.data.qfrc_bias, ours, rtol=0, atol=1e-10 * np.abs(ours).max())


def test_nothing_but_motors_acts(tree):
    model = to_mjmodel(tree, 1e-3)
    assert model.nu == tree.num_joints
    assert model.ngeom == 0
    assert model.nsite == len(tree.end_effector_names)
    np.testing.assert_array_equal(model.opt.gravity, 0.0)
    np.testing.assert_array_equal(model.dof_damping, 0.0)
    np.testing.assert_array_equal(model.dof_armature, 0.0)
    # One motor per joint: no row of the transmission reaches the base.
    np.testing.assert_array_equal(model.actuator_trnid[:, 0], 1 + np.arange(tree.num_joints))


def test_a_body_called_world_is_renamed(tree):
    topology = tree.topology
    names = ("world", *topology.body_names[1:])
    renamed = tree.replace(topology=type(topology)(**{**vars(topology), "body_names": names}))
    assert to_mjspec(renamed).compile().body(1).name == "world_body"


def test_flat_body_on_the_edge_of_the_triangle_inequality(tree):
    inertia = tree.inertia.copy()
    inertia[2] = np.diag([0.1, 0.2, 0.3 * (1 + 1e-10)])
    model = to_mjmodel(tree.replace(inertia=inertia), 1e-3)
    np.testing.assert_allclose(np.sort(model.body_inertia[3]), [0.1, 0.2, 0.3], rtol=1e-9)


def test_robot_that_mujoco_refuses(tree):
    mass = tree.mass.copy()
    mass[1] = -1.0
    with pytest.raises(InputError, match="MuJoCo does not accept the robot 'tree_prismatic'"):
        to_mjmodel(tree.replace(mass=mass), 1e-3)
