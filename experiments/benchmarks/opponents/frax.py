"""frax: base twist from its mass matrix of a floating base in every stage of the obvious rollout."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from experiments.benchmarks.bodies import plain_urdf
from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents import integrate


def twist(case: Case):
    """Base twist from the blocks of the mass matrix."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # advice on settings of the process
        from frax.core.robot import Robot
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(plain_urdf(case.robot), encoding="utf-8")
        model = Robot(str(path), joint_ordering=list(case.robot.joint_names), floating_base="quaternion")

    def of(q, qd, quaternion):
        unit = quaternion / jnp.linalg.norm(quaternion)
        mass = model.mass_matrix(jnp.concatenate([jnp.zeros(3, q.dtype), unit, q]))
        velocity = -jnp.linalg.solve(mass[:6, :6], mass[:6, 6:] @ qd)
        turn = integrate.rotation_matrix(unit)
        omega = turn @ velocity[3:]
        # The linear part is that of the root link's origin.
        lever = -turn @ np.asarray(case.robot.root_position)
        return jnp.concatenate([velocity[:3] + jnp.cross(omega, lever), omega])

    return of


def final_attitude(case: Case):
    """See `integrate.final_attitude`."""
    return integrate.final_attitude(case, twist(case))


def batched(function):
    """One vmap."""
    return jax.vmap(function)
