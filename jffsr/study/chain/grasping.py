"""The grasp itself: how far the tool is from the grasp frame then, and robot and target as one from then on."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.capture.contact_compound import Compound, grasped
from jffsr.compiling import program
from jffsr.dynamics.kinematics import end_effector_pose, jacobians, kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.target.body import Target
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.target_state import TargetState
from jffsr.types import Vector


@program(static_argnums=(4, 5), once=True)
def missed_by(
    robot: Robot, state: State, target: Target, target_state: TargetState, grasp: str, end_effector: str
) -> Vector:
    """Errors (12,) of the tool to the grasp frame: position, m, rotation vector, rad, velocity, m/s and rad/s, in I."""
    kin = kinematics(robot, state)
    position, quaternion = end_effector_pose(robot, kin, end_effector)
    of_base, of_joints = jacobians(robot, kin, end_effector)
    twist = of_base @ state.base_twist + of_joints @ state.joint_velocity
    place, attitude, speed = grasp_frame(target, target_state, grasp)
    turn = quaternion_multiply(quaternion_conjugate(attitude), quaternion)
    return jnp.concatenate([position - place, quaternion_to_rotation_vector(turn), twist - speed])


def compound_of(
    robot: Robot, state: State, target: Target, target_state: TargetState, end_effector: str
) -> Compound:
    """Robot and target after a plastic impact, on the host; the arm's joints are free meanwhile."""
    return jax.device_get(_compound(robot, state, target, target_state, end_effector))


@program(static_argnums=4, once=True)
def _compound(robot, state, target, target_state, end_effector):
    return grasped(robot, state, target, target_state, end_effector)
