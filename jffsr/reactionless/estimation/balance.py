"""The momentum balance of one sample, and the share that a rigid load has in it.

The robot without its load is known. About the system's centre of mass the whole has L = H_w w_0 + H_wphi qd, and

    d = H_w^r w_0 + H_wphi^r qd = L - dH_w w_0 - dH_wphi qd

holds exactly, d being the angular momentum of the robot alone about its own centre of mass: the load adds its spin
and mu a x a', with mu the reduced mass of robot and load and a the way between their centres of mass. Both depend on
w_0 and qd only, so that the linear velocity of the base, which no sensor aboard tells, is not needed. Everything is
resolved in B.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.dynamics.kinematics import end_effector_pose, jacobians, kinematics, system_com
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.interface import Measured
from jffsr.reactionless.null_space import reaction_blocks
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Matrix, Matrix3, Scalar, Vector, Vector3


@register_dataclass
@dataclass(frozen=True, eq=False)
class Balance:
    """The robot without its load at one sample, resolved in B.

    rotation (3, 3), B to I; base_rate (3,), rad/s; joint_velocity (n,); locked (3, 3) and coupling (3, n), kg m^2,
    about the robot's own centre of mass; lever (3,), m, from there to the tool; tool_rotation (3, 3), E to B;
    lever_jacobian and spin_jacobian (3, n), the tool's velocity relative to that centre and its angular velocity per
    joint rate; robot_mass (), kg; usable (), bool: fresh, and all of it finite.
    """

    rotation: Matrix3
    base_rate: Vector3
    joint_velocity: Vector
    locked: Matrix3
    coupling: Matrix
    lever: Vector3
    tool_rotation: Matrix3
    lever_jacobian: Matrix
    spin_jacobian: Matrix
    robot_mass: Scalar
    usable: Scalar

    @property
    def own_momentum(self) -> Vector3:
        """d (3,), N m s: the robot's own angular momentum, about its own centre of mass, in B."""
        return self.locked @ self.base_rate + self.coupling @ self.joint_velocity

    @property
    def regressor(self) -> Vector:
        """[1; w_0; qd], (n + 4,): d is linear in it."""
        return jnp.concatenate([jnp.ones(1), self.base_rate, self.joint_velocity])


@register_dataclass
@dataclass(frozen=True, eq=False)
class Load:
    """A rigid load in the tool frame E: mass (), kg; com (3,), m; inertia (3, 3), kg m^2, about its centre of mass."""

    mass: Scalar
    com: Vector3
    inertia: Matrix3


def balance_of(robot: Robot, measured: Measured, end_effector: str | None = None) -> Balance:
    """The balance of a robot without load from measurements; values that are lost or not finite are marked unusable.

    Raises InputError for an unknown end effector.
    """
    upright = jnp.array([1.0, 0.0, 0.0, 0.0])
    parts = (measured.base_quaternion, measured.base_rate, measured.joint_position, measured.joint_velocity)
    finite = jnp.array([jnp.all(jnp.isfinite(x)) for x in parts])
    given = [jnp.where(good, x, 0.0) for good, x in zip(finite, parts, strict=True)]
    quaternion = jnp.where(finite[0], given[0], upright)
    # In the axes of B the blocks depend on the joints alone.
    kin = kinematics(robot, State(jnp.zeros(3), upright, given[2]))
    locked, coupling = reaction_blocks(robot, kin)
    mass = jnp.asarray(robot.mass)
    centre = system_com(robot, kin)
    centre_jacobian = jnp.einsum("b,bij->ij", mass, kin.com_jacobian) / jnp.sum(mass)
    tool, tool_quaternion = end_effector_pose(robot, kin, end_effector)
    _, j_m = jacobians(robot, kin, end_effector)
    rotation = quaternion_to_matrix(quaternion)
    return Balance(
        rotation=rotation,
        base_rate=rotation.T @ given[1],
        joint_velocity=given[3],
        locked=locked,
        coupling=coupling,
        lever=tool - centre,
        tool_rotation=quaternion_to_matrix(tool_quaternion),
        lever_jacobian=j_m[:3] - centre_jacobian,
        spin_jacobian=j_m[3:],
        robot_mass=jnp.sum(mass),
        usable=jnp.asarray(measured.fresh) & jnp.all(finite),
    )


def load_blocks(balance: Balance, load: Load) -> tuple[Matrix3, Array]:
    """dH_w (3, 3) and dH_wphi (3, n), kg m^2, in B: what a load adds to the blocks of the robot alone."""
    offset = balance.tool_rotation @ load.com
    arm = balance.lever + offset
    arm_jacobian = balance.lever_jacobian - skew(offset) @ balance.spin_jacobian
    inertia = balance.tool_rotation @ load.inertia @ balance.tool_rotation.T
    reduced = load.mass * balance.robot_mass / (load.mass + balance.robot_mass)
    return (
        inertia + reduced * parallel_axis(arm),
        inertia @ balance.spin_jacobian + reduced * skew(arm) @ arm_jacobian,
    )
