"""The joint terms of a rollout as the textbook has them: from the inertia blocks of every point of the grid.

Umetani and Yoshida 1989, with the linear momentum eliminated by hand. Some twenty times as slow as `hot_path` (a
rollout of seven axes, batches of 8, one core: 868 instead of 38 us), whose test it is, and independent of it.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.dynamics.momentum import inertia_blocks
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.joint_terms import JointTerms
from jffsr.spatial.components import symmetric_elements
from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.types import Array, Vector


def plain_joint_terms(robot: Robot, joint_position: Array, joint_velocity: Array) -> JointTerms:
    """Terms of a grid of joint positions and rates, (G, n) each."""
    return jax.vmap(_at_one_point, (None, 0, 0))(robot, joint_position, joint_velocity)


def _at_one_point(robot: Robot, q: Vector, qd: Vector) -> JointTerms:
    # With the base at the identity pose, I and B coincide.
    kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), q))
    h_b, h_bm, _ = inertia_blocks(robot, kin)
    total, com = h_b[0, 0], system_com(robot, kin)
    inverse = jnp.linalg.inv(h_b[3:, 3:] - total * parallel_axis(com))
    linear, about_base = h_bm[:3] @ qd, h_bm[3:] @ qd
    return JointTerms(
        inverse_inertia=symmetric_elements(inverse),
        joint_rate=tuple(inverse @ (about_base - skew(com) @ linear)),
        com=tuple(com),
        com_velocity=tuple(linear / total),
    )
