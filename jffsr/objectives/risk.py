"""One number for the values that a plan has over robots that it may meet: the mean of the worst share of them.

The conditional value at risk of level b is the mean of the worst 1 - b of all outcomes (Rockafellar and Uryasev,
"Optimization of conditional value-at-risk", Journal of Risk 2, 2000). Level 0 is the expected value; from level
1 - 1/K on it is the worst of K values.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.types import Array, Scalar

# Softplus is its own asymptote beyond this many widths, to the last bit of float64.
_FAR = 40.0
_BISECTIONS = 60


def value_at_risk_mean(values: Array, level: Scalar) -> Scalar:
    """Mean of the worst share 1 - level of values (K,), each of probability 1/K; the value on the edge counts in part.

    Values that are not finite count as +inf, so that one of them in the share makes the result infinite.
    """
    count = values.shape[0]
    worst_first = -jnp.sort(-jnp.where(jnp.isnan(values), jnp.inf, values))
    share = _share(level, count)
    weight = jnp.clip(share * count - jnp.arange(count), 0.0, 1.0) / (share * count)
    # Infinity times a weight of zero would be NaN.
    return jnp.sum(jnp.where(weight > 0, weight * worst_first, 0.0))


def smooth_value_at_risk_mean(values: Array, level: Scalar, width: Scalar) -> Scalar:
    """The same, differentiable where two values change places: never below it, and within width log(2)/(1 - level).

    Of the form min over t of t + mean(max(0, values - t))/(1 - level), with the hinge rounded off over `width`, in
    the values' unit. At its minimum the derivative by t is zero, so that t, found by bisection, is a constant to the
    gradient.
    """
    share = _share(level, values.shape[0])
    held = jax.lax.stop_gradient(values)

    def halve(_, bounds):
        low, high = bounds
        middle = (low + high) / 2
        # The share of the hinges that are up falls as t rises.
        up = jnp.mean(jax.nn.sigmoid((held - middle) / width)) > share
        return jnp.where(up, middle, low), jnp.where(up, high, middle)

    low, high = jnp.min(held) - _FAR * width, jnp.max(held) + _FAR * width
    low, high = jax.lax.fori_loop(0, _BISECTIONS, halve, (low, high))
    edge = (low + high) / 2
    return edge + jnp.mean(width * jax.nn.softplus((values - edge) / width)) / share


def _share(level: Scalar, count: int) -> Scalar:
    return jnp.clip(1.0 - level, 1.0 / count, 1.0)
