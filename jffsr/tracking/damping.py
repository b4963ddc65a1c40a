"""How much damping each singular value gets, as the square h(sigma) in the gain sigma / (sigma^2 + h(sigma)).

Every rate inverse but the transpose is V g(Sigma) U' with a gain g of this form; h is even in sigma, so that g is
odd, and constant or a raised cosine. Its divided differences are written out without a subtraction that cancels,
because the derivative of the inverse is made of them.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.types import Array, Scalar

Damping = tuple[Array, Array]
"""(lambda, epsilon): the largest damping, and the singular value from which there is none; infinite: constant."""


def constant(damping: Scalar) -> Damping:
    """The same damping for every singular value (Wampler 1986)."""
    return jnp.asarray(damping, dtype=float), jnp.asarray(jnp.inf)


def raised_cosine(lambda_max: Scalar, epsilon: Scalar) -> Damping:
    """Wu et al. 2018, eq. 16: lambda_max (1 + cos(pi sigma/epsilon))/2 below epsilon, none above."""
    return jnp.asarray(lambda_max, dtype=float), jnp.asarray(epsilon, dtype=float)


def damping_of(sigma: Array, damping: Damping) -> Array:
    """Damping lambda(sigma), elementwise, in the units of the singular values; sigma may have either sign."""
    largest, epsilon = damping
    phase = jnp.pi * _share(sigma, epsilon)
    return 0.5 * largest * (1 + jnp.cos(phase))


def gain(sigma: Array, damping: Damping) -> Array:
    """What a singular value is answered with: sigma / (sigma^2 + lambda(sigma)^2), elementwise."""
    return sigma / (sigma**2 + damping_of(sigma, damping) ** 2)


def gain_difference(a: Array, b: Array, damping: Damping) -> Array:
    """Divided difference (g(a) - g(b)) / (a - b), elementwise and for either signs; g'(a) where a = b."""
    lambda_a, lambda_b = damping_of(a, damping), damping_of(b, damping)
    h_a, h_b = lambda_a**2, lambda_b**2
    slope = (lambda_a + lambda_b) * _damping_difference(a, b, damping)
    return (0.5 * (h_a + h_b) - a * b - 0.5 * (a + b) * slope) / ((a**2 + h_a) * (b**2 + h_b))


def _share(sigma: Array, epsilon: Scalar) -> Array:
    return jnp.clip(sigma / epsilon, -1.0, 1.0)


def _damping_difference(a: Array, b: Array, damping: Damping) -> Array:
    """(lambda(a) - lambda(b)) / (a - b)."""
    largest, epsilon = damping
    # An infinite epsilon is a constant: its share is zero everywhere, and so is the difference.
    share_a, share_b = _share(a, epsilon), _share(b, epsilon)
    inside = (jnp.abs(a) < epsilon) & (jnp.abs(b) < epsilon)
    apart = a != b
    ratio = jnp.where(
        inside, 1 / epsilon, jnp.where(apart, (share_a - share_b) / jnp.where(apart, a - b, 1.0), 0.0)
    )
    sine = jnp.sin(0.5 * jnp.pi * (share_a + share_b)) * jnp.sinc(0.5 * (share_a - share_b))
    return -0.5 * jnp.pi * largest * sine * ratio
