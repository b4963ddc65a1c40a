"""Singular values and vectors of many small matrices at once, by one-sided Jacobi rotations.

LAPACK takes one matrix after another: of a vectorized tracker's time it was two thirds. One-sided Jacobi (Hestenes
1958) turns pairs of columns until all are orthogonal, which is the same arithmetic for every matrix of a batch; with
the batch in the lanes of vector registers a 6 x 6 matrix takes 0.3 to 0.5 us where LAPACK takes 5 (one core of a
processor with AVX-512, float64, batches of 64 to 1,000). It is at least as accurate: small singular values
keep their digits relative to their own columns (Demmel and Veselic 1992). One matrix alone is left to LAPACK.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap

from jffsr.types import Array, Matrix, Vector

FEWEST = 4
"""A batch of fewer matrices is left to LAPACK."""
LARGEST_SIDE = 16
"""And so are matrices whose shorter side is longer: each pair of columns is written out in the program."""
MOST_SWEEPS = 15


@custom_vmap
def singular_bases(matrix: Matrix) -> tuple[Matrix, Vector, Matrix]:
    """u (m, k), sigma (k,) and v (n, k) with u diag(sigma) v' the matrix (m, n), k = min(m, n), in any order.

    Under vmap the basis of the longer side may have zero columns where sigma is zero. Not differentiable.
    """
    u, sigma, vh = jnp.linalg.svd(matrix, full_matrices=False)
    return u, sigma, vh.T


@singular_bases.def_vmap
def _many(
    axis_size: int, in_batched: list[bool], matrix: Array
) -> tuple[tuple[Array, ...], tuple[bool, ...]]:
    short = min(matrix.shape[-2:])
    if axis_size < FEWEST or not 1 < short <= LARGEST_SIDE:
        u, sigma, vh = jnp.linalg.svd(matrix, full_matrices=False)
        return (u, sigma, jnp.swapaxes(vh, -1, -2)), (True, True, True)
    wide = matrix.shape[-2] < matrix.shape[-1]
    # Rows, columns, batch; the columns are those of the shorter side.
    tall = jnp.moveaxis(jnp.swapaxes(matrix, -1, -2) if wide else matrix, 0, -1)
    turned, basis = orthogonalized(tall)
    squared = jnp.sum(turned * turned, axis=0)
    sigma = jnp.sqrt(squared)
    unit = turned * jnp.where(sigma > 0, 1 / jnp.where(sigma > 0, sigma, 1.0), 0.0)
    longer, shorter = jnp.moveaxis(unit, -1, 0), jnp.moveaxis(basis, -1, 0)
    u, v = (shorter, longer) if wide else (longer, shorter)
    return (u, jnp.moveaxis(sigma, -1, 0), v), (True, True, True)


def orthogonalized(matrices: Array) -> tuple[Array, Array]:
    """Matrices (r, c, B), r >= c, times orthogonal ones (c, c, B) so that their columns are orthogonal; and those."""
    rows, count, batch = matrices.shape
    eye = jnp.broadcast_to(jnp.eye(count, dtype=matrices.dtype)[:, :, None], (count, count, batch))
    both = jnp.concatenate([matrices, eye])
    # Near the end a sweep squares what is left: from under this it goes below rounding.
    enough = float(jnp.finfo(matrices.dtype).eps) ** 0.65
    # Without barriers the compiler computes each rotation again for each column that comes of it.
    barrier = jax.lax.optimization_barrier

    def unfinished(carry) -> Array:
        _, cosine, sweeps = carry
        # A matrix that is not finite waits for no one, and no one for it.
        return jnp.any(cosine > enough) & (sweeps < MOST_SWEEPS)

    def sweep(carry):
        columns, _, sweeps = carry
        columns, largest = list(columns), jnp.zeros(batch, dtype=matrices.dtype)
        for i, j in _pairs(count):
            x, y = columns[i], columns[j]
            a, b, g = (jnp.sum(p[:rows] * q[:rows], axis=0) for p, q in ((x, x), (y, y), (x, y)))
            c, s, between = barrier(_rotation(a, b, g))
            columns[i], columns[j] = barrier((c * x - s * y, s * x + c * y))
            largest = jnp.maximum(largest, between)
        return tuple(columns), largest, sweeps + 1

    start = tuple(both[:, k] for k in range(count)), jnp.full(batch, jnp.inf, matrices.dtype), 0
    columns, _, _ = jax.lax.while_loop(unfinished, sweep, start)
    found = jnp.stack(columns, axis=1)
    return found[:rows], found[rows:]


def _rotation(a: Array, b: Array, g: Array) -> tuple[Array, Array, Array]:
    """Cosine and sine that make columns orthogonal whose squares are a and b and whose product is g; the cosine between
    them."""
    apart = b - a
    # The smaller root of g t^2 + (b - a) t - g = 0, without cancellation.
    below = apart + jnp.where(apart < 0, -1.0, 1.0) * jnp.sqrt(apart * apart + 4 * g * g)
    t = jnp.where(below == 0, 0.0, 2 * g / jnp.where(below == 0, 1.0, below))
    c = jax.lax.rsqrt(1 + t * t)
    lengths = jnp.sqrt(a) * jnp.sqrt(b)
    between = jnp.where(lengths > 0, jnp.abs(g) / jnp.where(lengths > 0, lengths, 1.0), 0.0)
    return c, t * c, between


def _pairs(count: int) -> list[tuple[int, int]]:
    """All pairs of columns in rounds in which each column has one partner (a round-robin tournament)."""
    even = count + count % 2
    seats, found = list(range(even)), []
    for _ in range(even - 1):
        met = (sorted((seats[k], seats[even - 1 - k])) for k in range(even // 2))
        found += [(i, j) for i, j in met if j < count]
        seats = [seats[0], seats[-1], *seats[1:-1]]
    return found


def in_descending_order(values: Vector) -> Vector:
    """The values (k,), largest first, by exchanges of neighbours: for a few values of a batch, faster than a sort."""
    rows = list(values)
    for turn in range(len(rows)):
        for k in range(turn % 2, len(rows) - 1, 2):
            rows[k], rows[k + 1] = jnp.maximum(rows[k], rows[k + 1]), jnp.minimum(rows[k], rows[k + 1])
    return jnp.stack(rows)
