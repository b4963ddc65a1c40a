"""One step of damped least squares towards a pose, within joint limits, in numbers that vmap makes long arrays.

The damping follows the error (Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method",
IEEE Transactions on Robotics, 2011): far away and where the pose is out of reach steps are short, near a solution
they are Newton's. A joint that stands at a limit and would be pushed beyond it takes no part in the step.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.types import Array

DAMPING = 0.05
"""Squared damping per squared error, lengths in units of the arm's own."""
LEAST_DAMPING = 1e-12
LARGEST_STEP = 1.0
"""Largest change of a joint in one step, rad, or m per length of the arm."""


def limited_step(
    columns: tuple[tuple[Array, ...], ...],
    error: tuple[Array, ...],
    q: tuple[Array, ...],
    bounds: tuple[tuple[Array, Array], ...],
    length: Array,
) -> tuple[Array, ...]:
    """Joint positions after one step.

    columns, six numbers [linear; angular] for each joint, m and rad; error, what takes the tool to the wanted pose,
    [m; rad]; q, rad or m; bounds, lower and upper for each; length, m, that counts as much as a radian.
    """
    weight = 1 / length
    error = (*(weight * x for x in error[:3]), *error[3:])
    columns = [(*(weight * x for x in column[:3]), *column[3:]) for column in columns]
    pull = [_dot(column, error) for column in columns]
    kept = [
        jnp.where(((p > 0) & (x >= upper)) | ((p < 0) & (x <= lower)), 0.0, 1.0)
        for p, x, (lower, upper) in zip(pull, q, bounds, strict=True)
    ]
    columns = [tuple(free * x for x in column) for free, column in zip(kept, columns, strict=True)]
    damping = DAMPING * _dot(error, error) + LEAST_DAMPING
    rows = list(zip(*columns, strict=True))
    matrix = [[_dot(rows[r], rows[k]) + (damping if r == k else 0.0) for k in range(r + 1)] for r in range(6)]
    matrix, columns = jax.lax.optimization_barrier((matrix, columns))
    solution = jax.lax.optimization_barrier(_cholesky_solve(matrix, error))
    step = [_dot(column, solution) for column in columns]
    longest = step[0] * 0
    for x in step:
        longest = jnp.maximum(longest, jnp.abs(x))
    shrink = LARGEST_STEP / jnp.maximum(longest, LARGEST_STEP)
    return tuple(
        jnp.clip(x + shrink * dx, lower, upper) for x, dx, (lower, upper) in zip(q, step, bounds, strict=True)
    )


def _dot(a, b) -> Array:
    total = a[0] * b[0]
    for x, y in zip(a[1:], b[1:], strict=True):
        total = total + x * y
    return total


def _cholesky_solve(matrix: list[list[Array]], right: tuple[Array, ...]) -> tuple[Array, ...]:
    """Solution of A x = b for a positive definite A, given by its lower triangle."""
    n = len(matrix)
    lower = [[None] * n for _ in range(n)]
    inverse = [None] * n
    for k in range(n):
        rest = matrix[k][k]
        for j in range(k):
            rest = rest - lower[k][j] * lower[k][j]
        # Rounding may leave a singular matrix a pivot of zero or less.
        inverse[k] = 1 / jnp.sqrt(jnp.maximum(rest, 0.1 * LEAST_DAMPING))
        for i in range(k + 1, n):
            rest = matrix[i][k]
            for j in range(k):
                rest = rest - lower[i][j] * lower[k][j]
            lower[i][k] = rest * inverse[k]
    x = list(right)
    for k in range(n):
        for j in range(k):
            x[k] = x[k] - lower[k][j] * x[j]
        x[k] = x[k] * inverse[k]
    for k in reversed(range(n)):
        for j in range(k + 1, n):
            x[k] = x[k] - lower[j][k] * x[j]
        x[k] = x[k] * inverse[k]
    return tuple(x)
