"""jffsr's own rollout: `jffsr.rollout`, in chunks over all devices."""

from __future__ import annotations

import jax
import jax.numpy as jnp

import jffsr
from experiments.benchmarks.cases import Case, initial_state
from jffsr.rollouts.hot_path import hot_joint_terms
from jffsr.spatial.components import add, cross, quaternion_rows, rows_times

IN_CHUNKS = True
GRID = 4096


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

    def of_grid(postures):
        q, qd, quaternion = postures
        terms = hot_joint_terms(robot, q, qd)
        zero = jnp.zeros(q.shape[0], q.dtype)
        omega = terms.base_rate((zero, zero, zero))
        swing = add(cross(omega, terms.com), terms.com_velocity)
        turn = quaternion_rows(tuple(quaternion.T))
        linear, angular = rows_times(turn, swing), rows_times(turn, omega)
        return jnp.stack([-linear[0], -linear[1], -linear[2], *angular], axis=-1)

    def of(q, qd, quaternion):
        # Grids of the length that a rollout has, so that they stay near the core.
        grids = max(1, q.shape[0] // GRID)
        rows = [x.reshape(grids, -1, x.shape[-1]) for x in (q, qd, quaternion)]
        return jax.lax.map(of_grid, rows).reshape(-1, 6)

    return of
