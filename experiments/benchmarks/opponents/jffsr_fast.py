"""jffsr's own rollout: `jffsr.rollout`, in chunks over all devices."""

from __future__ import annotations

import jax.numpy as jnp

import jffsr
from experiments.benchmarks.cases import Case, initial_state
from experiments.benchmarks.opponents.integrate import rotation_matrix
from jffsr.rollouts.hot_path import hot_joint_terms
from jffsr.spatial.components import add, cross

IN_CHUNKS = True


def final_attitude(case: Case):
    """A function of one candidate (2n,): the final base quaternion (4,)."""

    def of(free):
        trajectory = case.trajectory.with_free(free)
        return jffsr.rollout(case.robot, trajectory, initial_state(), num_steps=case.steps).base_quaternion[
            -1
        ]

    return of


def batched(function):
    """Chunks, over all devices."""
    return lambda batch: in_chunks(function, batch)


def in_chunks(function, batch):
    """`jffsr.map_batch`: the one place that says how jffsr maps over a batch."""
    return jffsr.map_batch(function, batch)


def twists(case: Case):
    """Base twists (batch, 6) of a batch of postures: the joint terms, which the rollout evaluates a grid at a time."""
    robot = case.robot

    def of(q, qd, quaternion):
        terms = hot_joint_terms(robot, q, qd)
        zero = jnp.zeros(q.shape[0], q.dtype)
        omega = terms.base_rate((zero, zero, zero))
        swing = add(cross(omega, terms.com), terms.com_velocity)
        turn = rotation_matrix(quaternion.T)
        body = jnp.stack([jnp.stack([-x for x in swing]), jnp.stack(omega)])
        return jnp.einsum("rkb,tkb->btr", turn, body).reshape(-1, 6)

    return of
