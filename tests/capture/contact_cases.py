"""A seven-axis robot and a target that meet at its tool, in one random state."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from scipy.spatial.transform import Rotation

import jffsr

INERTIA = np.array([[2.0, 0.1, -0.2], [0.1, 2.5, 0.3], [-0.2, 0.3, 1.8]])
ROBOT = jffsr.load_robot("servicer_7dof")
TARGET = jffsr.Target.create(INERTIA, 60.0)


def meeting() -> tuple[jffsr.State, jffsr.TargetState]:
    """States with the target's centre of mass 0.66 m from the tool."""
    rng = np.random.default_rng(11)
    base, body = Rotation.random(2, rng=rng).as_quat(scalar_first=True)
    joints = np.deg2rad([10.0, -60.0, 20.0, 45.0, -30.0, -15.0, 5.0])
    state = jffsr.State(rng.normal(size=3), base, joints, 0.1 * rng.normal(size=6), 0.2 * rng.normal(size=7))
    tool, _ = jffsr.end_effector_pose(ROBOT, jffsr.kinematics(ROBOT, state))
    centre = np.asarray(tool) + np.array([0.5, -0.3, 0.3])
    return state, jffsr.TargetState.create(centre, 0.1 * rng.normal(size=3), body, 0.3 * rng.normal(size=3))


STATE, TARGET_STATE = meeting()


def planar_meeting(distance: float, rate: float):
    """Ye's arm, straight and at rest, and his target, its centre of mass beyond the tip, turning."""
    robot = jffsr.load_robot("ye_2019_planar3")
    state = jffsr.State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), jnp.zeros(3), jnp.zeros(6), jnp.zeros(3))
    target = jffsr.Target.create((2.5, 2.5, 2.5), 5.0)
    return (
        robot,
        state,
        target,
        jffsr.TargetState.create((3.5 + distance, 0, 0), (0, 0, 0), (1, 0, 0, 0), (0, 0, rate)),
    )


def with_rates(state: jffsr.State, base_twist, joint_velocity) -> jffsr.State:
    """The state with other velocities."""
    return replace(state, base_twist=jnp.asarray(base_twist), joint_velocity=jnp.asarray(joint_velocity))
