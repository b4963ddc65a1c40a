"""jffsr's readable path: `jffsr.reference_rollout`, the 6 x 6 momentum equation in every stage, one vmap."""

from __future__ import annotations

import jax
import numpy as np

import jffsr
from experiments.benchmarks.cases import Case, initial_state


def final_attitude(case: Case):
    """A function of one candidate (2n,): the final base quaternion (4,)."""

    def of(free):
        trajectory = case.trajectory.with_free(free)
        motion = jffsr.reference_rollout(case.robot, trajectory, initial_state(), num_steps=case.steps)
        return motion.base_quaternion[-1]

    return of


def twist(case: Case):
    """The public functions for one state."""

    def of(q, qd, quaternion):
        kin = jffsr.kinematics(case.robot, jffsr.State(np.zeros(3, q.dtype), quaternion, q))
        return jffsr.base_twist(case.robot, kin, qd)

    return of


def batched(function):
    """One vmap."""
    return jax.vmap(function)
