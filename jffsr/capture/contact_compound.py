"""Robot and captured target as one: the compound, its state and its momentum, for what is planned next."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.capture.contact import Contact, grasp_impact
from jffsr.capture.contact_bodies import JOINTS_FREE
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.pytrees import register_dataclass
from jffsr.robots.composing.composition import weld
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True, eq=False)
class Compound:
    """A robot with its target, right after a rigid grasp.

    robot: the target's mass and inertia are part of the body that carries the end effector; state, with velocities;
    momentum (6,): P, then L about the common centre of mass, in I, which stays as it is while nothing acts from
    outside; contact: the impact that led here.
    """

    robot: Robot
    state: State
    momentum: Array
    contact: Contact


def grasped(
    robot: Robot,
    state: State,
    target: Target,
    target_state: TargetState,
    end_effector: str | None = None,
    joints: str = JOINTS_FREE,
) -> Compound:
    """The compound of a robot and a target that it grasps rigidly where both are, after the impact.

    The impact is plastic in all six directions, so that nothing moves against anything afterwards but the joints. The
    target's mass and inertia must be in kg and kg m^2. Raises InputError for unknown end effectors and joints.
    """
    contact = grasp_impact(robot, state, target, target_state, end_effector, joints=joints)
    tool, tool_quaternion = end_effector_pose(robot, kinematics(robot, state), end_effector)
    back = quaternion_conjugate(tool_quaternion)
    body = RigidBody(target.mass, jnp.zeros(3), jnp.asarray(target.inertia), target.name, target.geometry)
    compound = weld(
        robot,
        body,
        end_effector=end_effector,
        position=quaternion_to_matrix(back) @ (target_state.position - tool),
        quaternion=quaternion_multiply(back, jnp.asarray(target_state.quaternion)),
    )
    # A target on the base moves the base's centre of mass, where its frame is.
    after = contact.state
    shift = quaternion_to_matrix(jnp.asarray(after.base_quaternion)) @ (
        robot.root_position - compound.root_position
    )
    velocity = after.base_twist[:3] + jnp.cross(after.base_twist[3:], shift)
    moved = State(
        after.base_position + shift,
        after.base_quaternion,
        after.joint_position,
        jnp.concatenate([velocity, after.base_twist[3:]]),
        after.joint_velocity,
    )
    return Compound(compound, moved, contact.momentum_after, contact)
