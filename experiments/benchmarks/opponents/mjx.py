"""MJX: base twist from its mass matrix (kinematics, com_pos, crb) in every stage of the obvious rollout."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents import integrate
from jffsr.crosscheck.mujoco_model import branch_order, to_mjmodel
from jffsr.crosscheck.quiet import import_mjx


def twist(case: Case):
    """Base twist from the blocks of MuJoCo's mass matrix."""
    mjx = import_mjx()
    native = to_mjmodel(jax.tree.map(lambda x: np.asarray(x, float), case.robot), case.step)
    model, blank = mjx.put_model(native, impl="jax"), mjx.make_data(native, impl="jax")
    order = branch_order(case.robot.topology)

    def of(q, qd, quaternion):
        # MJX brings the quaternion to unit length itself.
        state = blank.replace(qpos=jnp.concatenate([jnp.zeros(3, q.dtype), quaternion, q[order]]))
        data = mjx.crb(model, mjx.com_pos(model, mjx.kinematics(model, state)))
        mass = mjx.full_m(model, data)
        velocity = -jnp.linalg.solve(mass[:6, :6], mass[:6, 6:] @ qd[order])
        # The free joint's angular velocity is resolved in the base.
        unit = quaternion / jnp.linalg.norm(quaternion)
        return jnp.concatenate([velocity[:3], integrate.rotation_matrix(unit) @ velocity[3:]])

    return of


def final_attitude(case: Case):
    """See `integrate.final_attitude`."""
    return integrate.final_attitude(case, twist(case), looped=True)


def batched(function):
    """One vmap."""
    return jax.vmap(function)
