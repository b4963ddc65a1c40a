"""How the base and the tool of a state answer to joint rates and to momentum: both affine, computed once."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp

from jffsr.dynamics.base_mode import base_freedom
from jffsr.dynamics.kinematics import Kinematics, jacobians, system_com
from jffsr.dynamics.momentum import inertia_blocks
from jffsr.robots.robot import Robot
from jffsr.types import Matrix, Twist, Vector


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
    h_b, h_bm, _ = inertia_blocks(robot, kin)
    lever = system_com(robot, kin) - kin.base_position
    about_base = jnp.concatenate([momentum[:3], momentum[3:] + jnp.cross(lever, momentum[:3])])
    # One solve for all columns: what is computed once is also differentiated once.
    columns = jnp.concatenate([-h_bm, about_base[:, None]], axis=1)[:free]
    solved = jnp.linalg.solve(h_b[:free, :free], columns)
    both = jnp.concatenate([solved, jnp.zeros((6 - free, n + 1))])
    tool = j_b @ both
    return Response(both[:, :n], both[:, n], j_m + tool[:, :n], tool[:, n])
