"""The base-frame terms of the fast path against the inertia blocks of the readable one.

One chain, one tree with joints of both kinds, and the same tree with sliding joints alone; for the other robots
the agreement of whole motions says the same.
"""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.dynamics.momentum import base_twist, inertia_blocks, momentum
from jffsr.robots.robot import PRISMATIC
from jffsr.robots.state import State
from jffsr.rollouts.joint_terms import joint_terms
from jffsr.spatial.inertia import parallel_axis, skew

STATES = 5


@pytest.mark.parametrize("name", ["wu_2018_6dof", "two_arms", "slides"])
def test_joint_terms_are_the_inertia_blocks_without_linear_momentum(robots, name):
    """With the base at the identity pose I and B coincide; the linear momentum is eliminated by hand."""
    robot = robots["two_arms" if name == "slides" else name]
    if name == "slides":
        kinds = (PRISMATIC,) * robot.num_joints
        robot = robot.replace(topology=replace(robot.topology, joint_types=kinds))
    rng = np.random.default_rng(5)
    q, qd = rng.uniform(-2, 2, (2, STATES, robot.num_joints))
    angular_momentum = rng.normal(size=3)

    def blocks(robot, q, qd):
        kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0, 0, 0]), q))
        h_b, h_bm, _ = inertia_blocks(robot, kin)
        com = system_com(robot, kin)
        total = h_b[0, 0]
        locked = h_b[3:, 3:] - total * parallel_axis(com)
        carried = (h_bm[3:] - skew(com) @ h_bm[:3]) @ qd
        given = jnp.concatenate([jnp.zeros(3), angular_momentum])
        rate = base_twist(robot, kin, qd, given)[3:]
        held = momentum(robot, kin, jnp.zeros(6), qd)
        return locked, carried, com, h_bm[:3] @ qd / total, rate, held[3:]

    locked, carried, com, com_velocity, rate, held = jax.jit(jax.vmap(blocks, (None, 0, 0)))(robot, q, qd)
    terms = jax.jit(joint_terms)(robot, q, qd)
    xx, yy, zz, xy, xz, yz = terms.inverse_inertia
    inverse = jnp.moveaxis(jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), -1, 0)

    chex.assert_shape(inverse, (STATES, 3, 3))
    near = {"rtol": 1e-12, "atol": 1e-12}
    np.testing.assert_allclose(inverse, np.linalg.inv(locked), **near)
    np.testing.assert_allclose(
        jnp.stack(terms.joint_rate, -1), np.linalg.solve(locked, carried[..., None])[..., 0], **near
    )
    np.testing.assert_allclose(jnp.stack(terms.com, -1), com, **near)
    np.testing.assert_allclose(jnp.stack(terms.com_velocity, -1), com_velocity, **near)
    np.testing.assert_allclose(jnp.stack(terms.base_rate(tuple(angular_momentum)), -1), rate, **near)
    np.testing.assert_allclose(carried, held, **near)
