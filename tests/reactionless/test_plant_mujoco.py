"""MuJoCo moves the robot as our plant does, under the same computer."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from loop_cases import POSTURE, ROBOT, START, loaded, waves

from jffsr.compiling import jit
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.reactionless.control.proportional_derivative import ProportionalDerivative
from jffsr.reactionless.plant import closed_loop
from jffsr.reactionless.plant_mujoco import closed_loop_mujoco
from jffsr.reactionless.plant_settings import JointDisturbance, LoopSettings, Sensors
from jffsr.reactionless.plant_strike import Pendulum


@pytest.fixture(scope="module")
def both():
    """A noisy, delayed loop with the paper's disturbance and a stroke, about an axis that is no plane's normal."""
    robot = loaded()
    moving = np.array([0.2, -0.1, 0.4])
    kin = kinematics(robot, START)
    twist = base_twist(robot, kin, moving, jnp.array([0.5, -0.3, 0.2, 0.2, 0.1, 1.25]))
    start = replace(START, base_twist=twist, joint_velocity=moving)
    controller = ProportionalDerivative.of(ROBOT, POSTURE)
    settings = LoopSettings(
        30,
        substeps=4,
        delay=1,
        torque_limit=5.0,
        sensors=Sensors(gyro=1e-4, encoder=1e-5, rate=1e-4),
        disturbance=JointDisturbance.published(),
        strike=Pendulum().strike(0.1),
    )
    arguments = (robot, start, waves(30), controller, settings, jax.random.key(3))
    return jit(closed_loop)(*arguments), closed_loop_mujoco(*arguments)


def test_the_motions_agree(both):
    ours, mujoco = both
    for name in ("joint_position", "base_position", "base_quaternion"):
        np.testing.assert_allclose(getattr(ours.states, name), getattr(mujoco.states, name), atol=1e-6)
    for name in ("joint_velocity", "base_twist"):
        np.testing.assert_allclose(getattr(ours.states, name), getattr(mujoco.states, name), atol=2e-5)
    assert float(jnp.ptp(ours.states.joint_position[:, 2])) > 0.02
    np.testing.assert_allclose(ours.torque, mujoco.torque, atol=1e-3)
    np.testing.assert_allclose(ours.disturbance, mujoco.disturbance, atol=1e-12)


def test_mujocos_momentum_is_ours(both):
    ours, mujoco = both
    np.testing.assert_allclose(ours.momentum, mujoco.momentum, atol=1e-5)
    gained = np.asarray(mujoco.momentum[-1] - mujoco.momentum[0])
    np.testing.assert_allclose(gained[5], 0.01 * Pendulum().moment, rtol=1e-3)
    assert int(ours.code) == int(mujoco.code)
