"""Everything positional of a state, computed once: poses, inertias and Jacobians in the inertial frame."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.compiling.options import one_program
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import REVOLUTE, Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import skew
from jffsr.spatial.rotation import axis_angle_to_matrix, matrix_to_quaternion, quaternion_to_matrix
from jffsr.types import Array, Matrix, Quaternion, Vector3


@register_dataclass
@dataclass(frozen=True)
class Kinematics:
    """Poses and Jacobians of a robot in one state, all resolved in I.

    base_position (3,); rotation (b, 3, 3), body to I; origin (b, 3), frame origins; com (b, 3), centres of
    mass; axis (n, 3) and anchor (n, 3), a joint's axis and a point on it; inertia_I (b, 3, 3) about each
    centre of mass; com_jacobian (b, 3, n) and angular_jacobian (b, 3, n), velocity of each centre of mass
    and angular velocity of each body per joint rate with the base held.
    """

    base_position: Array
    rotation: Array
    origin: Array
    com: Array
    axis: Array
    anchor: Array
    inertia_I: Array
    com_jacobian: Array
    angular_jacobian: Array


@one_program
def kinematics(robot: Robot, state: State) -> Kinematics:
    """Kinematics of a state (base pose and joint positions; velocities are not used)."""
    topology = robot.topology
    rotations = [quaternion_to_matrix(jnp.asarray(state.base_quaternion))]
    origins = [jnp.asarray(state.base_position)]
    coms = [origins[0]]
    axes, anchors = [], []
    for i, parent in enumerate(topology.parents):
        q = state.joint_position[i]
        anchor = origins[parent] + rotations[parent] @ robot.joint_position[i]
        rotation = rotations[parent] @ robot.joint_rotation[i]
        axis = rotation @ robot.joint_axis[i]
        if topology.joint_types[i] == REVOLUTE:
            rotation = rotation @ axis_angle_to_matrix(robot.joint_axis[i], q)
            origin = anchor
        else:
            origin = anchor + axis * q
        axes.append(axis)
        anchors.append(anchor)
        rotations.append(rotation)
        origins.append(origin)
        coms.append(origin + rotation @ robot.link_com[i])
    rotation, com = jnp.stack(rotations), jnp.stack(coms)
    axis, anchor = jnp.stack(axes), jnp.stack(anchors)
    inertia_I = rotation @ robot.inertia @ jnp.swapaxes(rotation, -1, -2)
    linear, angular = _point_jacobian(robot, axis, anchor, com, topology.support)
    return Kinematics(
        base_position=origins[0],
        rotation=rotation,
        origin=jnp.stack(origins),
        com=com,
        axis=axis,
        anchor=anchor,
        inertia_I=inertia_I,
        com_jacobian=linear,
        angular_jacobian=angular,
    )


def _point_jacobian(robot: Robot, axis, anchor, point, support) -> tuple[Array, Array]:
    """Jacobians (k, 3, n) of points (k, 3) fixed on bodies whose supporting joints are `support` (k, n)."""
    revolute = robot.topology.is_revolute[:, None]
    lever = point[:, None, :] - anchor[None, :, :]
    linear = jnp.where(revolute, jnp.cross(axis[None], lever), axis[None])
    angular = jnp.where(revolute, axis, 0.0)[None]
    mask = support[:, :, None]
    return (
        jnp.swapaxes(jnp.where(mask, linear, 0.0), 1, 2),
        jnp.swapaxes(jnp.where(mask, angular, 0.0), 1, 2),
    )


@one_program
def system_com(robot: Robot, kin: Kinematics) -> Vector3:
    """Centre of mass of the whole system (3,), m, in I."""
    mass = jnp.asarray(robot.mass)
    return mass @ kin.com / jnp.sum(mass)


def _tool(robot: Robot, kin: Kinematics, end_effector: str | None) -> tuple[int, Vector3, Matrix]:
    index = robot.end_effector_index(end_effector)
    body = robot.topology.end_effector_bodies[index]
    position = kin.origin[body] + kin.rotation[body] @ robot.end_effector_position[index]
    return body, position, kin.rotation[body] @ robot.end_effector_rotation[index]


@one_program(static_argnames="end_effector")
def end_effector_pose(
    robot: Robot, kin: Kinematics, end_effector: str | None = None
) -> tuple[Vector3, Quaternion]:
    """Position (3,), m, and attitude quaternion (4,) of an end effector in I; None means the first."""
    _, position, rotation = _tool(robot, kin, end_effector)
    return position, matrix_to_quaternion(rotation)


@one_program(static_argnames="end_effector")
def jacobians(robot: Robot, kin: Kinematics, end_effector: str | None = None) -> tuple[Matrix, Matrix]:
    """Base Jacobian J_b (6, 6) and joint Jacobian J_m (6, n) of an end effector.

    Its twist in I, [linear; angular], is J_b base_twist + J_m joint_velocity.
    """
    body, position, _ = _tool(robot, kin, end_effector)
    eye, zero = jnp.eye(3), jnp.zeros((3, 3))
    j_b = jnp.block([[eye, -skew(position - kin.base_position)], [zero, eye]])
    support = robot.topology.support[body][None]
    linear, angular = _point_jacobian(robot, kin.axis, kin.anchor, position[None], support)
    return j_b, jnp.concatenate([linear[0], angular[0]])
