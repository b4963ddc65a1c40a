"""MuJoCo's own reading of a robot file, for comparison: its mass matrix in this package's coordinates."""

from __future__ import annotations

import jax
import mujoco
import numpy as np

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.dynamics.momentum import inertia_blocks
from jffsr.robots.geometry import Geometry
from jffsr.robots.state import State


class MujocoReference:
    """A file as MuJoCo compiles it, its base set free, without armature."""

    def __init__(self, path, base=None):
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False
        body = spec.body(base) if base else spec.worldbody.bodies[0]
        if not body.joints:
            body.add_freejoint()
        self.model = spec.compile()
        self.base = self.model.body(body.name).id
        self.model.dof_armature[:] = 0
        self.data = mujoco.MjData(self.model)

    def set(self, robot, state):
        """Put the model into a state; a base above which the file has fixed frames is not handled."""
        r = np.zeros(9)
        mujoco.mju_quat2Mat(r, np.asarray(state.base_quaternion))
        self.rotation = r.reshape(3, 3)
        # The base body's frame is the root link's.
        self.to_com = -self.rotation @ np.asarray(robot.root_position)
        self.data.qpos[:3] = state.base_position - self.to_com
        self.data.qpos[3:7] = state.base_quaternion
        self.columns = list(range(6))
        for name, value in zip(robot.joint_names, state.joint_position, strict=True):
            joint = self.model.joint(name)
            self.data.qpos[joint.qposadr[0]] = value
            self.columns.append(joint.dofadr[0])
        mujoco.mj_forward(self.model, self.data)

    def inertia(self):
        """The matrix of [velocity of the base's centre of mass; angular velocity in I; joint rates]."""
        matrix = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, matrix)
        matrix = matrix[np.ix_(self.columns, self.columns)]
        turn = np.eye(len(self.columns))
        x, y, z = self.to_com
        turn[:3, 3:6] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
        turn[3:6, 3:6] = self.rotation.T
        return turn.T @ matrix @ turn

    def site(self, name):
        """Position and rotation matrix of a site."""
        site = self.data.site(name)
        return site.xpos.copy(), site.xmat.reshape(3, 3).copy()

    def body(self, name):
        """Position and rotation matrix of a body's frame."""
        body = self.data.body(name)
        return body.xpos.copy(), body.xmat.reshape(3, 3).copy()


def random_state(robot, seed):
    """A random pose of the base and of the joints."""
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    return State(
        base_position=rng.normal(size=3),
        base_quaternion=quaternion / np.linalg.norm(quaternion),
        joint_position=rng.uniform(-2, 2, robot.num_joints),
    )


@jax.jit
def _evaluate(robot, state):
    kin = kinematics(robot, state)
    tools = {name: end_effector_pose(robot, kin, name) for name in robot.end_effector_names}
    return inertia_blocks(robot, kin), tools


def evaluate(robot, state):
    """The blocks of `jffsr.inertia_blocks` as one matrix, and the poses of the end effectors by name."""
    # Without shapes, so that a robot and what is read back of it share the compiled program.
    blocks, tools = _evaluate(robot.replace(geometry=Geometry()), state)
    base, coupling, joints = (np.asarray(block) for block in blocks)
    poses = {name: tuple(np.asarray(part) for part in pose) for name, pose in tools.items()}
    return np.block([[base, coupling], [coupling.T, joints]]), poses


def assert_same_inertia(path, robot, seeds=range(3), base=None):
    """The robot has the mass matrix that MuJoCo computes from the file."""
    reference = MujocoReference(path, base)
    for seed in seeds:
        state = random_state(robot, seed)
        reference.set(robot, state)
        expected = reference.inertia()
        np.testing.assert_allclose(
            evaluate(robot, state)[0], expected, rtol=0, atol=1e-10 * np.abs(expected).max()
        )
    return reference
