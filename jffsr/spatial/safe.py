"""Norms, roots, angles and hinges whose gradients stay finite where the plain ones give NaN."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.types import Array


def safe_sqrt(x: Array) -> Array:
    """Square root of x >= 0, elementwise, whose gradient at zero is zero instead of infinite."""
    positive = x > 0
    # Both branches of `where` are differentiated, so the dead one must not see zero either.
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, x, 1.0)), 0.0)


def safe_norm(x: Array, axis: int = -1) -> Array:
    """Euclidean norm along an axis, whose gradient at the zero vector is zero."""
    return safe_sqrt(jnp.sum(x * x, axis=axis))


def safe_atan2(y: Array, x: Array) -> Array:
    """Angle of (x, y) in (-pi, pi], elementwise, with value and gradient zero where both are zero."""
    origin = (x == 0) & (y == 0)
    return jnp.where(origin, 0.0, jnp.arctan2(y, jnp.where(origin, 1.0, x)))


@jax.custom_jvp
def peak(x: Array) -> Array:
    """Largest value along the first axis; the gradient goes to the first place that holds it.

    The gradient of `jnp.max` looks for the places that equal the maximum: a compiler that computes x twice,
    rounded differently, leaves none, and the gradient is NaN.
    """
    return jnp.max(x, axis=0)


@peak.defjvp
def _peak_jvp(primals, tangents):
    (x,), (x_dot,) = primals, tangents
    place = jnp.argmax(x, axis=0)[None]
    return peak(x), jnp.take_along_axis(x_dot, place, axis=0)[0]


def smooth_norm(x: Array, width: float, axis: int = -1) -> Array:
    """Norm rounded off within `width` of zero: sqrt(|x|^2 + width^2) - width, which tends to |x|."""
    return jnp.sqrt(jnp.sum(x * x, axis=axis) + width**2) - width


def smooth_hinge(x: Array, width: float) -> Array:
    """max(0, x) rounded off within a few `width` of zero: width log(1 + exp(x/width)), elementwise."""
    return width * jax.nn.softplus(x / width)


def smooth_max(x: Array, width: float, axis: int = 0) -> Array:
    """Largest value along an axis, rounded off: width log(sum(exp(x/width))), never below the maximum."""
    return width * jax.scipy.special.logsumexp(x / width, axis=axis)
