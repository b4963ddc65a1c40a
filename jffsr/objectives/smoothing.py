"""How far the smooth index is rounded off where the published one has a corner."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.spatial.safe import peak, safe_norm, smooth_hinge, smooth_max, smooth_norm
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class Smoothing:
    """Widths of the rounding; as all three tend to zero, every smooth term tends to the published one.

    norm, relative to the scale of the term whose norm is taken; peak and overrun, relative to the limit.
    """

    norm: Array | float = 0.5
    peak: Array | float = 2e-3
    overrun: Array | float = 2e-3

    def loosened(self, looseness: Array | float) -> Smoothing:
        """Wider rounding for the way to the valley; looseness 1 changes nothing.

        A rounded norm is a parabola of curvature 1/width, a rounded overrun one of much smaller curvature:
        the norm's width takes the square of the factor to bring the two together.
        """
        return Smoothing(self.norm * looseness**2, self.peak * looseness, self.overrun * looseness)


def overrun(values: Array, limit: Array) -> Scalar:
    """Sum over columns of max(0, (peak |values| - limit)/limit), Li 2022 eqs. (39), (41).

    values (K, c) over time; limit (c,), infinite where there is none.
    """
    return jnp.sum(jnp.maximum(0.0, peak(jnp.abs(values)) / limit - 1))


def smooth_overrun(values: Array, limit: Array, smoothing: Smoothing) -> Scalar:
    """The same with a log-sum-exp peak, which is never below the true one, and a softplus hinge."""
    ratio = values / limit
    largest = smooth_max(jnp.concatenate([ratio, -ratio]), smoothing.peak)
    return jnp.sum(smooth_hinge(largest - 1, smoothing.overrun))


def error_norm(error: Array) -> Scalar:
    """Euclidean norm of an error vector; its gradient at zero error is zero."""
    return safe_norm(error)


def smooth_error_norm(error: Array, scale: Array, smoothing: Smoothing) -> Scalar:
    """The same, rounded off at zero over a width in units of the term's scale."""
    return smooth_norm(error, smoothing.norm * scale)
