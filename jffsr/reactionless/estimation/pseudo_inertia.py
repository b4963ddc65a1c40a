"""A load's inertia as ten free numbers, all of which a rigid body can have.

With S the second moments of mass about a frame's origin, h the first moment and m the mass, the pseudo-inertia
[[S, h], [h', m]] is positive definite just where the body is one (Wensing, Kim and Slotine 2018). It is U U' with

    U = e^a [[e^d1, s12, s13, t1], [0, e^d2, s23, t2], [0, 0, e^d3, t3], [0, 0, 0, 1]]

for one set of ten numbers (a, d1, d2, d3, s12, s23, s13, t1, t2, t3) (Rucker and Wensing 2022). Then m = e^(2a), the
centre of mass is t, and m V V' is the second moment about it, V being the upper left block of U without the factor.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.reactionless.estimation.balance import Load
from jffsr.types import Array

NUM_PARAMETERS = 10


def load_from_parameters(parameters: Array) -> Load:
    """The load, in any frame, of ten numbers (10,)."""
    a, d1, d2, d3, s12, s23, s13 = parameters[:7]
    zero = jnp.zeros_like(a)
    factor = jnp.stack(
        [
            jnp.stack([jnp.exp(d1), s12, s13]),
            jnp.stack([zero, jnp.exp(d2), s23]),
            jnp.stack([zero, zero, jnp.exp(d3)]),
        ]
    )
    mass = jnp.exp(2 * a)
    moments = mass * factor @ factor.T
    return Load(mass, parameters[7:], jnp.trace(moments) * jnp.eye(3) - moments)


def parameters_from_load(load: Load) -> Array:
    """The ten numbers (10,) of a load; not finite where it is no rigid body, or a flat one."""
    inertia = jnp.asarray(load.inertia)
    moments = (0.5 * jnp.trace(inertia) * jnp.eye(3) - inertia) / load.mass
    # V is upper triangular: the Cholesky factor of the reversed matrix, reversed.
    factor = jnp.linalg.cholesky(moments[::-1, ::-1])[::-1, ::-1]
    return jnp.concatenate(
        [
            0.5 * jnp.log(jnp.asarray(load.mass, dtype=float))[None],
            jnp.log(jnp.diagonal(factor)),
            jnp.stack([factor[0, 1], factor[1, 2], factor[0, 2]]),
            jnp.asarray(load.com, dtype=float),
        ]
    )
