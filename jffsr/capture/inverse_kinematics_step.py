"""One step of damped least squares towards a pose, within joint limits, in numbers that vmap makes long arrays.

The damping follows the error (Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method",
IEEE Transactions on Robotics, 2011): far away and where the pose is out of reach steps are short, near a solution
they are Newton's. A joint that stands at a limit and would be pushed beyond it takes no part in the step.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.types import Array, Vector

DAMPING = 0.05
"""Squared damping per squared error, lengths in units of the arm's own."""
LEAST_DAMPING = 1e-12
LARGEST_STEP = 1.0
"""Largest change of a joint in one step, rad or m."""


def limited_step(
    rows: tuple[Vector, ...],
    error: tuple[Array, ...],
    q: Vector,
    lower: Vector,
    upper: Vector,
    length: Array,
) -> Vector:
    """Joint positions (k,) after one step.

    rows (6 of (k,)), the Jacobian [linear; angular]; error, six numbers that take the tool to the wanted pose, m and
    rad; q, lower and upper (k,), rad or m, the joints and their limits; length, m, that counts as much as a radian.
    """
    weight = 1 / length
    error = (*(weight * x for x in error[:3]), *error[3:])
    rows = (*(weight * row for row in rows[:3]), *rows[3:])
    pull = _dot(rows, error)
    free = ~(((pull > 0) & (q >= upper)) | ((pull < 0) & (q <= lower)))
    rows = tuple(jnp.where(free, row, 0.0) for row in rows)
    rows = jax.lax.optimization_barrier(rows)
    damping = DAMPING * _dot(error, error) + LEAST_DAMPING
    matrix = [
        [jnp.sum(rows[r] * rows[k]) + (damping if r == k else 0.0) for k in range(r + 1)] for r in range(6)
    ]
    solution = jax.lax.optimization_barrier(_cholesky_solve(jax.lax.optimization_barrier(matrix), error))
    step = _dot(rows, solution)
    shrink = LARGEST_STEP / jnp.maximum(jnp.max(jnp.abs(step)), LARGEST_STEP)
    return jnp.clip(q + shrink * step, lower, upper)


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
