"""Cross-product matrices and the parallel-axis term."""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.types import Matrix3, Vector3


def skew(v: Vector3) -> Matrix3:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3): skew(a) b = a x b."""
    x, y, z = jnp.moveaxis(v, -1, 0)
    zero = jnp.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def parallel_axis(v: Vector3) -> Matrix3:
    """|v|^2 1 - v v' (..., 3, 3): the inertia of a unit point mass at v (..., 3) about the origin."""
    squared = jnp.sum(v * v, axis=-1)[..., None, None]
    return squared * jnp.eye(3, dtype=v.dtype) - v[..., :, None] * v[..., None, :]
