"""Gauss-Newton over many poses at once: the most probable motion of a free target for all that a camera has seen.

Each pass follows the motion from its first instant and linearises every pose about that one motion. An extended Kalman
filter, which linearises each pose about another estimate, seems to learn from their differences what no pose tells.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.target.camera import Measurements
from jffsr.target.estimate import NUM_ERRORS, TargetEstimate
from jffsr.target.filter_steps import MEASURED, advance, innovation
from jffsr.target.prior import TargetPrior
from jffsr.types import Array, Matrix, Scalar

# Keeps the normal equations regular where no pose was seen at all; nothing beside any pose.
_VAGUE = 1e-8 * np.eye(NUM_ERRORS)


@register_dataclass
@dataclass(frozen=True, eq=False)
class FitPass:
    """What one pass over the poses finds, all about the motion that it started from.

    end: the estimate one interval after the last pose of the pass; transition (20, 20) of errors at the first pose to
    those at the end; matrix (20, 20) and vector (20,) of the normal equations; squared (N,), normalised squared
    residuals of the poses, zero beyond the pass.
    """

    end: TargetEstimate
    transition: Matrix
    matrix: Matrix
    vector: Array
    squared: Array

    @property
    def correction(self) -> Array:
        """Error (20,) of the start, by the normal equations."""
        return jnp.linalg.solve(self.matrix, self.vector)

    @property
    def estimate(self) -> TargetEstimate:
        """The end with its covariance."""
        covariance = self.transition @ jnp.linalg.inv(self.matrix) @ self.transition.T
        return replace(self.end, covariance=(covariance + covariance.T) / 2)


def fit_pass(
    start: TargetEstimate,
    poses: Measurements,
    until: Scalar,
    weigh: Callable[[Array, Array], Array],
    interval: float,
    prior: TargetPrior,
    noise: Matrix,
    order: int,
) -> FitPass:
    """One pass over the first `until` poses, at least one, of (N, ...), from an estimate at the first of them.

    `weigh` gives a pose's weight () by its index and its normalised squared residual, for noise of covariance (6, 6);
    the prior counts as it does at the first pose.
    """
    precision = jnp.linalg.inv(noise)

    def follow(k, carry):
        estimate, transition, matrix, vector, squares = carry
        residual = innovation(estimate, poses.position[k], poses.quaternion[k])
        residual = jnp.where(poses.seen[k], residual, 0.0)
        squared = residual @ precision @ residual
        rows = MEASURED @ transition
        weighed = poses.seen[k] * weigh(k, squared) * rows.T @ precision
        moved, step = advance(estimate, interval, order)
        return (
            moved,
            step @ transition,
            matrix + weighed @ rows,
            vector + weighed @ residual,
            squares.at[k].set(squared),
        )

    prior_residual, prior_rows = prior.normalised_residual(start), prior.derivative(start)
    matrix, vector = prior_rows.T @ prior_rows + _VAGUE, prior_rows.T @ prior_residual
    carry = (start, jnp.eye(NUM_ERRORS), matrix, vector, jnp.zeros(len(poses.time)))
    return FitPass(*jax.lax.fori_loop(0, until, follow, carry))
