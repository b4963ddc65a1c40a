"""adam: base twist from its mass matrix in every stage of the obvious rollout.

Under vmap its mass matrix raises in current JAX, so a batch goes through the batch axis that it has itself.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from experiments.benchmarks.bodies import plain_urdf
from experiments.benchmarks.cases import Case
from experiments.benchmarks.opponents import integrate


def twist(case: Case):
    """Base twist from the blocks of the mass matrix."""
    import adam
    from adam.jax import KinDynComputations

    model = KinDynComputations(plain_urdf(case.robot), list(case.robot.joint_names), dtype=case.dtype)
    model.set_frame_velocity_representation(adam.Representations.BODY_FIXED_REPRESENTATION)

    def placed_mass(turn, q):
        place = jnp.zeros((*turn.shape[:-2], 4, 4), q.dtype).at[..., 3, 3].set(1.0).at[..., :3, :3].set(turn)
        return model.mass_matrix(place, q)

    mass_matrix = jax.custom_batching.custom_vmap(placed_mass)

    @mass_matrix.def_vmap
    def _(size, batched, *arguments):
        whole = [
            x if has else jnp.broadcast_to(x, (size, *x.shape))
            for x, has in zip(arguments, batched, strict=True)
        ]
        return placed_mass(*whole), True

    def of(q, qd, quaternion):
        turn = integrate.rotation_matrix(quaternion / jnp.linalg.norm(quaternion))
        mass = mass_matrix(turn, q)
        velocity = -jnp.linalg.solve(mass[:6, :6], mass[:6, 6:] @ qd)
        omega = turn @ velocity[3:]
        # The linear part is that of the root link's origin.
        lever = -turn @ np.asarray(case.robot.root_position)
        return jnp.concatenate([turn @ velocity[:3] + jnp.cross(omega, lever), omega])

    return of


def final_attitude(case: Case):
    """See `integrate.final_attitude`."""
    return integrate.final_attitude(case, twist(case))


def batched(function):
    """One vmap."""
    return jax.vmap(function)
