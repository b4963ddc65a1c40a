"""Bias force, inverse dynamics and forward dynamics of a robot on a base that is free, held or fixed.

H [nudot; qdd] + c = [0; tau], where nudot is the derivative of the base twist in I. The recursions are those
of Featherstone, Rigid Body Dynamics Algorithms, 2008: Newton-Euler (table 5.1) with the free base of table
9.6, and articulated bodies (tables 7.1 and 9.4); each costs time in proportion to the number of joints.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.dynamics.kinematics import Kinematics
from jffsr.dynamics.spatial_tree import (
    body_twists,
    cross_force,
    cross_motion,
    inwards,
    motion_subspace,
    outwards,
    spatial_inertias,
)
from jffsr.robots.robot import Robot
from jffsr.types import Array, Matrix, Twist, Vector


def bias_force(robot: Robot, kin: Kinematics, base_twist: Twist, joint_velocity: Vector) -> Vector:
    """Bias force c (6 + n,) of H [nudot; qdd] + c = [0; tau]: what velocities alone ask for.

    Force, N, on the base and moment, N m, about its centre of mass, both in I, then joint torques, N m or N.
    """
    motion, inertia = motion_subspace(robot, kin), spatial_inertias(robot, kin)
    still = -_carried(base_twist)
    wrench = body_wrenches(
        robot, kin, inertia, motion, still, base_twist, joint_velocity, jnp.zeros(robot.num_joints)
    )
    carried = inwards(robot.topology.parents, wrench)
    return jnp.concatenate([carried[0], jnp.sum(motion * carried[1:], axis=-1)])


def inverse_dynamics(
    robot: Robot,
    kin: Kinematics,
    base_twist: Twist,
    joint_velocity: Vector,
    joint_acceleration: Vector,
    base_mode: str = FLOATING,
) -> tuple[Vector, Twist]:
    """Joint torques (n,), N m or N, that give these joint accelerations, and the base's acceleration (6,).

    The base reacts as its mode allows; its acceleration is the derivative of the base twist, resolved in I.
    Twist, rates and accelerations are [linear; angular] in I, (n,) in rad/s or m/s, and (n,) in rad/s^2 or
    m/s^2. Raises InputError for an unknown base_mode.
    """
    parents = robot.topology.parents
    motion, inertia = motion_subspace(robot, kin), spatial_inertias(robot, kin)
    # First with the base's twist constant, then the base's own acceleration is added to every body alike.
    still = -_carried(base_twist)
    wrench = body_wrenches(robot, kin, inertia, motion, still, base_twist, joint_velocity, joint_acceleration)
    carried, composite = inwards(parents, wrench), inwards(parents, inertia)
    acceleration = _base_reaction(composite[0], carried[0], base_mode)
    carried = carried + composite @ acceleration
    return jnp.sum(motion * carried[1:], axis=-1), acceleration


def forward_dynamics(
    robot: Robot,
    kin: Kinematics,
    base_twist: Twist,
    joint_velocity: Vector,
    joint_torque: Vector,
    base_mode: str = FLOATING,
) -> Vector:
    """Accelerations (6 + n,) under these joint torques (n,), N m or N, and no external force.

    First the derivative of the base twist, resolved in I, then the joint accelerations, rad/s^2 or m/s^2.
    Raises InputError for an unknown base_mode.
    """
    parents = robot.topology.parents
    motion, inertia = motion_subspace(robot, kin), spatial_inertias(robot, kin)
    twist = body_twists(robot, kin, base_twist, joint_velocity)
    coriolis = cross_motion(twist[1:], motion * joint_velocity[:, None])
    articulated = list(inertia)
    bias = list(cross_force(twist, (inertia @ twist[..., None])[..., 0]))
    held, share, lag = [None] * len(parents), [None] * len(parents), [None] * len(parents)
    for joint in reversed(range(len(parents))):
        body, parent = joint + 1, parents[joint]
        held[joint] = articulated[body] @ motion[joint]
        resistance = motion[joint] @ held[joint]
        share[joint] = held[joint] / resistance
        lag[joint] = (joint_torque[joint] - motion[joint] @ bias[body]) / resistance
        passed = articulated[body] - jnp.outer(held[joint], share[joint])
        articulated[parent] = articulated[parent] + passed
        bias[parent] = bias[parent] + bias[body] + passed @ coriolis[joint] + held[joint] * lag[joint]

    still = -_carried(base_twist)
    base = _base_reaction(articulated[0], bias[0] + articulated[0] @ still, base_mode)
    accelerations, joints = [base + still], []
    for joint, parent in enumerate(parents):
        before = accelerations[parent] + coriolis[joint]
        joints.append(lag[joint] - share[joint] @ before)
        accelerations.append(before + motion[joint] * joints[joint])
    return jnp.concatenate([base, jnp.stack(joints)])


def _carried(base_twist: Twist) -> Twist:
    """[w_0 x v_0; 0]: what turns a spatial acceleration of the base at O into the derivative of its twist."""
    return jnp.concatenate([jnp.cross(base_twist[3:], base_twist[:3]), jnp.zeros(3)])


def body_wrenches(
    robot: Robot,
    kin: Kinematics,
    inertia: Array,
    motion: Array,
    base_acceleration: Twist,
    base_twist: Twist,
    joint_velocity: Vector,
    joint_acceleration: Vector,
) -> Array:
    """Wrench (b, 6) about O that each body needs, I a + v x* I v; the base's acceleration is the spatial one at O.

    inertia (b, 6, 6) may be any spatial inertias about O: the wrench is linear in them.
    """
    twist = body_twists(robot, kin, base_twist, joint_velocity)
    coriolis = cross_motion(twist[1:], motion * joint_velocity[:, None])
    steps = motion * joint_acceleration[:, None] + coriolis
    acceleration = outwards(robot.topology.parents, base_acceleration, steps)
    momentum = (inertia @ twist[..., None])[..., 0]
    return (inertia @ acceleration[..., None])[..., 0] + cross_force(twist, momentum)


def _base_reaction(inertia: Matrix, wrench: Twist, base_mode: str) -> Twist:
    """Derivative (6,) of the base twist when its free directions feel no force.

    inertia (6, 6) is what the base moves, wrench (6,) what it takes to keep its twist constant.
    """
    free = base_freedom(base_mode)
    if free == 0:
        return jnp.zeros_like(wrench)
    return jnp.concatenate([-jnp.linalg.solve(inertia[:free, :free], wrench[:free]), jnp.zeros(6 - free)])
