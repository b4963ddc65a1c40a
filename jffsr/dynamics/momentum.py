"""Inertia blocks, momentum, the base twist that conserves it, and the generalized matrices.

With the base twist nu = [v_0; w_0] and everything referred to the base centre of mass r_0,
H_b nu + H_bm qd = [P; L + (r_com - r_0) x P], where P and L (about the system centre of mass) are constant
when no external force acts (Umetani and Yoshida 1989; Li 2022, eq. 20).
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.compiling.options import one_program
from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.dynamics.kinematics import Kinematics, jacobians, system_com
from jffsr.dynamics.spatial_tree import body_twists, spatial_inertias
from jffsr.robots.robot import Robot
from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.types import Matrix, Scalar, Twist, Vector


@one_program
def inertia_blocks(robot: Robot, kin: Kinematics) -> tuple[Matrix, Matrix, Matrix]:
    """Base inertia H_b (6, 6), coupling inertia H_bm (6, n), joint inertia H_m (n, n).

    Referred to the base centre of mass, resolved in I, order [v_0; w_0; qd].
    """
    mass = jnp.asarray(robot.mass)
    lever = kin.com - kin.base_position
    jv, jw = kin.com_jacobian, kin.angular_jacobian
    first_moment = skew(mass @ lever)
    locked = jnp.sum(kin.inertia_I + mass[:, None, None] * parallel_axis(lever), axis=0)
    h_b = jnp.block([[jnp.sum(mass) * jnp.eye(3), -first_moment], [first_moment, locked]])
    linear_momentum = mass[:, None, None] * jv
    spin = kin.inertia_I @ jw
    h_bm = jnp.concatenate(
        [jnp.sum(linear_momentum, axis=0), jnp.sum(spin + skew(lever) @ linear_momentum, axis=0)]
    )
    h_m = jnp.sum(jnp.swapaxes(jv, 1, 2) @ linear_momentum + jnp.swapaxes(jw, 1, 2) @ spin, axis=0)
    return h_b, h_bm, h_m


@one_program(static_argnames="base_mode")
def generalized_inertia(robot: Robot, kin: Kinematics, base_mode: str = FLOATING) -> Matrix:
    """Generalized inertia tensor H_m - H_bm' H_b^-1 H_bm (n, n) (Xu and Kanade 1992).

    It is what the joints feel when the base gives way as its mode allows; with a fixed base, H_m itself.
    Raises InputError for an unknown base_mode.
    """
    free = base_freedom(base_mode)
    h_b, h_bm, h_m = inertia_blocks(robot, kin)
    return h_m if free == 0 else h_m - h_bm[:free].T @ jnp.linalg.solve(h_b[:free, :free], h_bm[:free])


@one_program
def momentum(robot: Robot, kin: Kinematics, base_twist: Twist, joint_velocity: Vector) -> Twist:
    """Momentum (6,): P, N s, then L about the system centre of mass, N m s, both in I."""
    twists = body_twists(robot, kin, base_twist, joint_velocity)
    about_base = jnp.einsum("bij,bj->i", spatial_inertias(robot, kin), twists)
    linear, angular = about_base[:3], about_base[3:]
    lever = system_com(robot, kin) - kin.base_position
    return jnp.concatenate([linear, angular - jnp.cross(lever, linear)])


def _momentum_about_base(robot: Robot, kin: Kinematics, momentum: Twist) -> Twist:
    linear, angular = momentum[:3], momentum[3:]
    lever = system_com(robot, kin) - kin.base_position
    return jnp.concatenate([linear, angular + jnp.cross(lever, linear)])


@one_program(static_argnames="base_mode")
def base_twist(
    robot: Robot,
    kin: Kinematics,
    joint_velocity: Vector,
    momentum: Twist | None = None,
    base_mode: str = FLOATING,
) -> Twist:
    """Base twist (6,) in I that gives the system this momentum at these joint rates.

    `momentum` (6,) is P, then L about the system centre of mass; None means zero. With the attitude held only
    P counts, and what holds the attitude takes up the rest; a fixed base has no twist whatever the momentum.
    Raises InputError for an unknown base_mode.
    """
    free = base_freedom(base_mode)
    if free == 0:
        return jnp.zeros(6)
    h_b, h_bm, _ = inertia_blocks(robot, kin)
    about_base = -h_bm @ joint_velocity
    if momentum is not None:
        about_base = about_base + _momentum_about_base(robot, kin, jnp.asarray(momentum))
    return jnp.concatenate([jnp.linalg.solve(h_b[:free, :free], about_base[:free]), jnp.zeros(6 - free)])


@one_program(static_argnames=("end_effector", "base_mode"))
def generalized_jacobian(
    robot: Robot, kin: Kinematics, end_effector: str | None = None, base_mode: str = FLOATING
) -> Matrix:
    """Generalized Jacobian J* = J_m - J_b H_b^-1 H_bm (6, n) (Umetani and Yoshida 1989).

    The tool twist in I under zero momentum is J* joint_velocity; with a fixed base J* is J_m. Raises
    InputError for an unknown end effector or base_mode.
    """
    free = base_freedom(base_mode)
    h_b, h_bm, _ = inertia_blocks(robot, kin)
    j_b, j_m = jacobians(robot, kin, end_effector)
    if free == 0:
        return j_m
    return j_m - j_b[:, :free] @ jnp.linalg.solve(h_b[:free, :free], h_bm[:free])


@one_program
def kinetic_energy(robot: Robot, kin: Kinematics, base_twist: Twist, joint_velocity: Vector) -> Scalar:
    """Kinetic energy, J, of the whole system."""
    twists = body_twists(robot, kin, base_twist, joint_velocity)
    return 0.5 * jnp.einsum("bi,bij,bj->", twists, spatial_inertias(robot, kin), twists)
