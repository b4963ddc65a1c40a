"""Motion under torques: the momentum equation's own motion, MuJoCo's, order 4, gradients."""

from __future__ import annotations

from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from motions import Quintic

from jffsr.crosscheck.mujoco_model import to_mjmodel
from jffsr.dynamics.base_mode import ATTITUDE_HELD, BASE_MODES, FLOATING
from jffsr.dynamics.equations_of_motion import inverse_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist, kinetic_energy
from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout
from jffsr.rollouts.torque_driven import torque_rollout
from jffsr.spatial.rotation import quaternion_to_matrix

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"
MOMENTUM = np.array([3.0, -2.0, 1.0, 2.5, 1.5, -1.0])
ATTITUDE = np.array([0.8, 0.2, -0.4, 0.4])
DURATION = 2.0
STEPS = 80


@pytest.fixture(scope="module")
def robot():
    return load_robot(TREE)


@pytest.fixture(scope="module")
def start(robot):
    """A posture with the twist that MOMENTUM and joints at rest give."""
    state = State(np.array([0.3, -0.2, 0.1]), ATTITUDE, np.array([0.2, 0.1, -0.4, 0.6]))
    twist = base_twist(robot, kinematics(robot, state), jnp.zeros(4), MOMENTUM)
    return State(state.base_position, state.base_quaternion, state.joint_position, twist, np.zeros(4))


def _following(robot, trajectory, mode):
    """The torque that gives the trajectory's acceleration in whatever state the robot is."""

    def torque(time, state):
        kin = kinematics(robot, state)
        velocities = state.base_twist, state.joint_velocity
        return inverse_dynamics(robot, kin, *velocities, trajectory(time)[2], mode)[0]

    return torque


@pytest.mark.parametrize(
    "mode", [pytest.param(mode, marks=[] if mode == FLOATING else [pytest.mark.slow]) for mode in BASE_MODES]
)
def test_inverse_dynamics_drives_the_robot_along_the_momentum_equations_motion(robot, start, mode):
    goal = start.joint_position + np.array([0.9, 0.2, -0.8, 1.2])
    trajectory = Quintic(start.joint_position, goal, np.array(DURATION))
    state = start
    if mode != FLOATING:
        twist = base_twist(robot, kinematics(robot, start), jnp.zeros(4), MOMENTUM, mode)
        state = State(start.base_position, start.base_quaternion, start.joint_position, twist, np.zeros(4))
    driven = jax.jit(
        lambda s: torque_rollout(robot, _following(robot, trajectory, mode), s, DURATION, 400, base_mode=mode)
    )(state)
    planned = jax.jit(
        lambda s: rollout(robot, trajectory, s, num_steps=400, momentum=MOMENTUM, base_mode=mode)
    )(start)
    chex.assert_tree_all_finite(driven)
    assert driven.base_mode == mode
    for name in (
        "time",
        "base_position",
        "base_quaternion",
        "base_twist",
        "joint_position",
        "joint_velocity",
    ):
        np.testing.assert_allclose(getattr(driven, name), getattr(planned, name), rtol=0, atol=3e-8)
    assert np.ptp(driven.joint_torque, axis=0).min() > 0.01


def _spring(time, state):
    return -2.0 * state.joint_position - 0.5 * jnp.sin(3.0 * time)


@pytest.fixture(scope="module")
def driven(robot):
    """A motion under a torque of time and posture, in so many steps."""
    program = jax.jit(
        chex.assert_max_traces(
            lambda s, n, hold, scale=1.0: torque_rollout(
                robot, lambda t, x: scale * _spring(t, x), s, DURATION, n, hold=hold
            ),
            6,
        ),
        static_argnums=(1, 2),
    )
    return program


def test_the_order_is_four(driven, start):
    ends = [
        np.concatenate([motion.base_quaternion[-1], motion.joint_position[-1], motion.base_twist[-1]])
        for motion in (driven(start, n, False) for n in (STEPS, 2 * STEPS, 8 * STEPS))
    ]
    coarse, fine = (np.linalg.norm(end - ends[-1]) for end in ends[:2])
    assert coarse > 1e-9
    assert 3.7 < np.log2(coarse / fine) < 4.3


def test_power_is_the_change_of_energy(robot, driven, start):
    """The work of the torques, by Simpson's rule over the samples, is what the kinetic energy gains."""
    motion = driven(start, 8 * STEPS, False)
    energy = jax.vmap(lambda s: kinetic_energy(robot, kinematics(robot, s), s.base_twist, s.joint_velocity))(
        motion.states
    )
    power = np.sum(motion.joint_torque * motion.joint_velocity, axis=1)
    step = DURATION / (8 * STEPS)
    work = step / 3 * (power[0] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum() + power[-1])
    assert abs(work) > 0.1
    np.testing.assert_allclose(energy[-1] - energy[0], work, rtol=1e-7)


def test_a_held_torque_gives_mujocos_motion(robot, driven, start):
    """The same sampled controller on MuJoCo's model, Runge-Kutta of order 4 in both."""
    steps = 4 * STEPS
    ours = driven(start, steps, True)
    model = to_mjmodel(robot, DURATION / steps)
    data = mujoco.MjData(model)
    rotation = np.asarray(quaternion_to_matrix(jnp.asarray(ATTITUDE)))
    data.qpos[:] = np.concatenate([start.base_position, start.base_quaternion, start.joint_position])
    data.qvel[:] = np.concatenate([start.base_twist[:3], rotation.T @ start.base_twist[3:], np.zeros(4)])
    for k in range(steps):
        state = State(data.qpos[:3], data.qpos[3:7], data.qpos[7:])
        data.ctrl[:] = np.asarray(ours.joint_torque[k])
        np.testing.assert_allclose(_spring(ours.time[k], state), data.ctrl, rtol=0, atol=1e-7)
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(ours.base_position[-1], data.qpos[:3], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours.base_quaternion[-1], data.qpos[3:7], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours.joint_position[-1], data.qpos[7:], rtol=0, atol=1e-8)
    np.testing.assert_allclose(ours.joint_velocity[-1], data.qvel[6:], rtol=0, atol=1e-8)
    assert np.abs(ours.joint_position[-1] - start.joint_position).max() > 0.1


@pytest.mark.slow
def test_the_gradient_in_the_torque_is_the_difference(driven, start):
    def end(scale):
        return driven(start, STEPS, False, scale).base_position[-1, 0]

    h = 1e-4
    difference = (end(1.0 + h) - end(1.0 - h)) / (2 * h)
    gradient = jax.grad(end)(1.0)
    assert abs(gradient) > 1e-4
    np.testing.assert_allclose(gradient, difference, rtol=1e-6)


def test_missing_velocities_are_zero_and_held_ones_too(robot, start):
    still = State(start.base_position, start.base_quaternion, start.joint_position)
    motion = jax.jit(lambda s: torque_rollout(robot, None, s, 1.0, 2))(still)
    chex.assert_shape(motion.base_twist, (3, 6))
    for name in ("base_twist", "joint_velocity", "joint_torque"):
        np.testing.assert_array_equal(getattr(motion, name), 0.0)
    np.testing.assert_array_equal(motion.time, [0.0, 0.5, 1.0])
    held = jax.jit(lambda s: torque_rollout(robot, None, s, 1.0, 2, ATTITUDE_HELD))(start)
    np.testing.assert_array_equal(held.base_twist[:, 3:], 0.0)
    np.testing.assert_array_equal(held.base_twist[0, :3], start.base_twist[:3])


def test_wrong_arguments_are_refused(robot, start):
    with pytest.raises(InputError, match="num_steps is 0"):
        torque_rollout(robot, None, start, 1.0, 0)
    with pytest.raises(InputError, match="did you mean 'floating'"):
        torque_rollout(robot, None, start, 1.0, 2, base_mode="flaoting")
