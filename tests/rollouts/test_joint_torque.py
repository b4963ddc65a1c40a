"""Torques of a motion: MuJoCo accelerates under them as the motion does, and they drive the robot along it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from jffsr.compiling import ONCE
from jffsr.crosscheck.mujoco_model import to_mjmodel
from jffsr.dynamics.base_mode import BASE_MODES, FLOATING
from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State
from jffsr.rollouts.joint_torque import joint_torque, with_joint_torque
from jffsr.rollouts.rollout import rollout
from jffsr.rollouts.torque_driven import torque_rollout
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.trajectories.polynomial import Polynomial

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"
MOMENTUM = np.array([3.0, -2.0, 1.0, 2.5, 1.5, -1.0])
STEPS, DURATION = 200, 2.0
START = State(np.array([0.3, -0.2, 0.1]), np.array([0.8, 0.2, -0.4, 0.4]), np.array([0.2, 0.1, -0.4, 0.6]))
LAW = Polynomial.between(
    START.joint_position, [1.1, 0.3, -1.2, 1.8], DURATION, 7, start_rate=[0.3, 0.1, -0.2, 0.4]
)


@pytest.fixture(scope="module")
def robot():
    return load_robot(TREE)


@pytest.fixture(scope="module")
def motions(robot):
    """By base mode, with their torques; each is made when it is first asked for."""

    @cache
    def one(mode):
        def made():
            motion = rollout(robot, LAW, START, num_steps=STEPS, momentum=MOMENTUM, base_mode=mode)
            return with_joint_torque(robot, motion)

        return jax.jit(made, compiler_options=ONCE)()

    return one


def test_mujoco_accelerates_under_them_as_the_motion_does(robot, motions):
    motion = motions(FLOATING)
    assert motion.joint_torque.shape == (STEPS + 1, 4)
    model = to_mjmodel(robot, 1e-3)
    data = mujoco.MjData(model)
    for k in range(0, STEPS + 1, 25):
        turn = np.asarray(quaternion_to_matrix(jnp.asarray(motion.base_quaternion[k])))
        twist = motion.base_twist[k]
        data.qpos[:] = np.concatenate(
            [motion.base_position[k], motion.base_quaternion[k], motion.joint_position[k]]
        )
        data.qvel[:] = np.concatenate([twist[:3], turn.T @ twist[3:], motion.joint_velocity[k]])
        data.ctrl[:] = motion.joint_torque[k]
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc[6:], motion.joint_acceleration[k], rtol=0, atol=1e-9)
    assert np.ptp(motion.joint_torque, axis=0).min() > 0.01


@pytest.mark.parametrize(
    "mode", [pytest.param(mode, marks=[] if mode == FLOATING else [pytest.mark.slow]) for mode in BASE_MODES]
)
def test_open_loop_they_drive_the_robot_along_the_motion(robot, motions, mode):
    """The torques of all samples as a function of time alone; a step of the driven motion takes two samples."""
    planned = motions(mode)
    torques = jnp.asarray(planned.joint_torque)
    half = DURATION / STEPS
    start = State(
        START.base_position,
        START.base_quaternion,
        START.joint_position,
        planned.base_twist[0],
        planned.joint_velocity[0],
    )

    def torque(time, state):
        return torques[jnp.round(time / half).astype(int)]

    driven = jax.jit(lambda s: torque_rollout(robot, torque, s, DURATION, STEPS // 2, base_mode=mode))(start)
    for name in ("joint_position", "joint_velocity", "base_quaternion", "base_position"):
        np.testing.assert_allclose(getattr(driven, name), getattr(planned, name)[::2], rtol=0, atol=3e-7)


@pytest.mark.slow
@pytest.mark.parametrize("kinds", ["as they are", "all slide"])
def test_the_textbooks_inverse_dynamics_gives_the_same(robot, motions, kinds):
    """On a tree whose joints turn, slide, and do both in one unbranched part."""
    motion = motions(FLOATING)
    if kinds == "all slide":
        robot = robot.replace(topology=replace(robot.topology, joint_types=("prismatic",) * 4))
    both = jax.jit(
        lambda r: [joint_torque(r, motion, kernel) for kernel in ("fast", "plain")], compiler_options=ONCE
    )
    fast, plain = both(robot)
    np.testing.assert_allclose(fast, plain, rtol=0, atol=1e-10)
    assert np.ptp(plain, axis=0).min() > 0.01


def test_torques_that_a_motion_carries_are_not_computed_again(robot, motions):
    motion = motions(FLOATING)
    assert with_joint_torque(robot, motion) is motion
    with pytest.raises(InputError, match="kernel"):
        joint_torque(robot, motion, "quick")
