"""How far the smooth index is rounded off where the published one has a corner."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.spatial.safe import safe_norm, smooth_hinge, smooth_max, smooth_norm
from jffsr.types import Array, Scalar


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Smoothing:
    """Widths of the rounding; as all three tend to zero, every smooth term tends to the published one.

    norm, in the unit of the error whose norm is taken; peak and overrun, relative to the limit.
    """

    norm: Array | float = 1e-4
    peak: Array | float = 5e-3
    overrun: Array | float = 2e-3


def overrun(values: Array, limit: Array) -> Scalar:
    """Sum over columns of max(0, (peak |values| - limit)/limit), Li 2022 eqs. (39), (41).

    values (K, c) over time; limit (c,), infinite where there is none.
    """
    return jnp.sum(jnp.maximum(0.0, jnp.max(jnp.abs(values), axis=0) / limit - 1))


def smooth_overrun(values: Array, limit: Array, smoothing: Smoothing) -> Scalar:
    """The same with a log-sum-exp peak, which is never below the true one, and a softplus hinge."""
    ratio = values / limit
    peak = smooth_max(jnp.concatenate([ratio, -ratio]), smoothing.peak)
    return jnp.sum(smooth_hinge(peak - 1, smoothing.overrun))


def error_norm(error: Array) -> Scalar:
    """Euclidean norm of an error vector; its gradient at zero error is zero."""
    return safe_norm(error)


def smooth_error_norm(error: Array, smoothing: Smoothing) -> Scalar:
    """The same, rounded off at zero."""
    return smooth_norm(error, smoothing.norm)
