"""How the base and the tool of a state answer to joint rates and to momentum: both affine, computed once.

A unit rate of a joint moves what the joint carries as one rigid body, so that its momentum needs only that body's mass,
first moment and inertia, sums over the tree; and what is conserved about the system's centre of mass leaves a 3 x 3
inertia to be inverted. `jffsr.generalized_jacobian` and `jffsr.base_twist`, by the 6 x 6 base inertia, are the readable
version and the test. The kinematics included, six axes and batches of 64 and 1,024 on one core, they took 1.5 to 1.6
times as long.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import base_freedom
from jffsr.dynamics.kinematics import Kinematics, jacobians, system_com
from jffsr.robots.robot import Robot
from jffsr.spatial.components import symmetric_elements, symmetric_inverse
from jffsr.spatial.inertia import parallel_axis
from jffsr.types import Array, Matrix, Twist, Vector


class Response(NamedTuple):
    """Base twist (6,) = base_map (6, n) qd + base_drift (6,), tool twist = jacobian (6, n) qd + drift (6,), in I.

    jacobian is the generalized one, J_m - J_b H_b^-1 H_bm, and drift H* G, what momentum alone gives the tool.
    """

    base_map: Matrix
    base_drift: Twist
    jacobian: Matrix
    drift: Twist

    def base_twist(self, joint_rate: Vector) -> Twist:
        """Twist (6,) of the base at these joint rates (n,)."""
        return self.base_map @ joint_rate + self.base_drift


def response(
    robot: Robot, kin: Kinematics, momentum: Twist, end_effector: str | None, base_mode: str
) -> Response:
    """The response of a state under a momentum (6,), P and L about the system centre of mass."""
    free, n = base_freedom(base_mode), robot.num_joints
    j_b, j_m = jacobians(robot, kin, end_effector)
    if free == 0:
        return Response(jnp.zeros((6, n)), jnp.zeros(6), j_m, jnp.zeros(6))
    centre = system_com(robot, kin)
    linear, angular, inertia = _unit_momenta(robot, kin, centre)
    # What the base has to carry: the momentum, and against that of each joint's unit rate. Rows: the joints, then it.
    linear = jnp.concatenate([-linear, momentum[None, :3]])
    velocity, turning = linear / jnp.sum(jnp.asarray(robot.mass)), jnp.zeros_like(linear)
    if free == 6:
        angular = jnp.concatenate([-angular, momentum[None, 3:]])
        turning = angular @ _inverse(inertia)
        velocity = velocity - jnp.cross(turning, centre - kin.base_position)
    both = jnp.concatenate([velocity, turning], axis=1).T
    tool = j_b @ both
    return Response(both[:, :n], both[:, n], j_m + tool[:, :n], tool[:, n])


def _unit_momenta(robot: Robot, kin: Kinematics, centre: Array) -> tuple[Array, Array, Matrix]:
    """Momenta of unit joint rates with the base held, linear and about the centre of mass of the system (n, 3), and
    its locked inertia (3, 3) about that point."""
    topology, mass = robot.topology, jnp.asarray(robot.mass)
    lever = kin.com - centre
    about_centre = kin.inertia_I + mass[:, None, None] * parallel_axis(lever)
    each = jnp.concatenate([mass[:, None], mass[:, None] * lever, about_centre.reshape(-1, 9)], axis=1)
    # Bodies that each joint carries; the last row, all of them.
    carried = np.vstack([topology.support.T, np.ones(len(topology.support), dtype=bool)]).astype(each.dtype)
    whole = carried @ each
    masses, first, inertia = whole[:-1, :1], whole[:-1, 1:4], whole[:-1, 4:].reshape(-1, 3, 3)
    axis, arm = kin.axis, kin.anchor - centre
    swing = jnp.cross(axis, arm)
    linear = jnp.cross(axis, first) - masses * swing
    angular = jnp.einsum("jik,jk->ji", inertia, axis) - jnp.cross(first, swing)
    turns = topology.is_revolute
    if not turns.all():
        linear = jnp.where(turns[:, None], linear, masses * axis)
        angular = jnp.where(turns[:, None], angular, jnp.cross(first, axis))
    return linear, angular, whole[-1, 4:].reshape(3, 3)


def _inverse(inertia: Matrix) -> Matrix:
    """Of a symmetric positive definite matrix (3, 3)."""
    xx, yy, zz, xy, xz, yz = symmetric_inverse(symmetric_elements(inertia))
    return jnp.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz]).reshape(3, 3)
