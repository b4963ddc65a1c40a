"""Joint rates for a task velocity: plain, damped, adaptive and transposed inverses with safe derivatives.

The filtered inverse of J = U Sigma V' is V g(Sigma) U'. Differentiating the decomposition itself divides by
differences of squared singular values, which is NaN where two are equal. Here the derivative is that of the whole
function (Daleckii and Krein 1965, for two-sided decompositions Noferini 2017): in the bases of J,
dF'_ij = g[s_i, s_j] (E_ij + E_ji)/2 + g[s_i, -s_j] (E_ij - E_ji)/2 with divided differences of the odd gain, and
g(s_i)/s_i E_ij for what lies outside the smaller dimension. Finite wherever the gain is smooth.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.tracking.damping import Damping, constant, damping_of, gain, gain_difference, raised_cosine
from jffsr.tracking.jacobi_rotations import in_descending_order, singular_bases
from jffsr.types import Array, Matrix, Scalar, Vector

INVERSE, DAMPED, MANIPULABILITY, ADAPTIVE, TRANSPOSE = (
    "inverse",
    "damped",
    "manipulability",
    "adaptive",
    "transpose",
)
METHODS = (INVERSE, DAMPED, MANIPULABILITY, ADAPTIVE, TRANSPOSE)

RANK_CUT = 1e-12
"""Singular values below this share of the largest are rounding: their directions are left alone."""


@jax.custom_jvp
def inverse_and_values(jacobian: Matrix, damping: Damping, cut: float = RANK_CUT) -> tuple[Matrix, Vector]:
    """`filtered_inverse` and `singular_values` of a matrix (m, n) by one decomposition."""
    u, sigma, v = singular_bases(jacobian)
    kept = _kept(sigma, damping, cut)
    value = (v * jnp.where(kept, gain(jnp.where(kept, sigma, 1.0), damping), 0.0)) @ u.T
    return value, in_descending_order(sigma)


def filtered_inverse(jacobian: Matrix, damping: Damping, cut: float = RANK_CUT) -> Matrix:
    """V g(Sigma) U' (n, m) of a matrix (m, n), with g(s) = s/(s^2 + lambda(s)^2), zero for undamped zero values.

    Undamped values below `cut` of the largest count as zero. Without damping it is the Moore-Penrose inverse. Its
    derivative is right and finite at repeated singular values and, where there is damping, at zero ones; first
    derivatives only.
    """
    return inverse_and_values(jacobian, damping, cut)[0]


def _kept(sigma: Vector, damping: Damping, cut: float) -> Array:
    """Which singular values are answered: all that are damped, and of the others those above the cut."""
    rounding = cut * jnp.max(sigma)
    return (sigma > rounding) | (damping_of(sigma, damping) > rounding)


@inverse_and_values.defjvp
def _inverse_and_values_jvp(primals, tangents):
    (jacobian, damping, cut), (jacobian_dot, damping_dot, _) = primals, tangents
    # Whole bases, also where a singular value is zero.
    u, sigma, vh = jnp.linalg.svd(jacobian, full_matrices=False)
    v = vh.T
    kept = _kept(sigma, damping, cut)
    safe = jnp.where(kept, sigma, 1.0)
    value = jnp.where(kept, gain(safe, damping), 0.0)
    # g(s)/s, which does not need s to differ from zero.
    ratio = jnp.where(kept, 1 / (safe**2 + damping_of(safe, damping) ** 2), 0.0)

    rows, columns = jnp.meshgrid(sigma, sigma, indexing="ij")
    both = kept[:, None] & kept[None, :]
    one = kept[:, None] ^ kept[None, :]
    a, b = jnp.where(both, rows, 1.0), jnp.where(both, columns, 2.0)
    # A value that is left alone counts as zero: g[s, 0] = g(s)/s.
    alone = jnp.where(one, jnp.maximum(ratio[:, None], ratio[None, :]), 0.0)
    same = jnp.where(both, gain_difference(a, b, damping), alone)
    opposite = jnp.where(both, gain_difference(a, -b, damping), alone)
    inner = u.T @ jacobian_dot @ v
    core = 0.5 * (same * (inner + inner.T) + opposite * (inner - inner.T))

    # One of the two rests is empty: u or v is square.
    right = jacobian_dot - (jacobian_dot @ v) @ v.T
    left = jacobian_dot - u @ (u.T @ jacobian_dot)
    outside = (u * ratio) @ (u.T @ right) + ((left @ v) * ratio) @ v.T
    _, value_dot = jax.jvp(lambda d: gain(safe, d), (damping,), (damping_dot,))
    change = (u * jnp.where(kept, value_dot, 0.0)) @ v.T
    found = (v * value) @ u.T, sigma
    return found, ((u @ core @ v.T + outside + change).T, jnp.diagonal(inner))


@jax.custom_jvp
def singular_values(jacobian: Matrix) -> Vector:
    """Singular values (min(m, n),) of a matrix, largest first; their derivative is finite where two are equal."""
    return in_descending_order(singular_bases(jacobian)[1])


@singular_values.defjvp
def _singular_values_jvp(primals, tangents):
    u, sigma, vh = jnp.linalg.svd(primals[0], full_matrices=False)
    return sigma, jnp.einsum("ik,ij,kj->k", u, tangents[0], vh)


def manipulability(jacobian: Matrix) -> Scalar:
    """Product of the singular values of a matrix (m, n), sqrt(det(J J')) for m <= n (Yoshikawa 1985)."""
    return jnp.prod(singular_values(jacobian))


def manipulability_damping(jacobian: Matrix, largest: Scalar, threshold: Scalar) -> Scalar:
    """Nakamura and Hanafusa 1986: lambda = largest (1 - w/threshold) where the manipulability w is below it."""
    return largest * jnp.clip(1 - manipulability(jacobian) / threshold, 0.0, 1.0)


def null_space(jacobian: Matrix, damping: Damping) -> Matrix:
    """Projector (n, n) on the joint rates that the task does not see; it passes singular directions smoothly.

    1 - J# J with the filtered inverse: exactly the projector where no singular value is damped.
    """
    return jnp.eye(jacobian.shape[1]) - filtered_inverse(jacobian, damping) @ jacobian


def transposed_rates(jacobian: Matrix, velocity: Vector) -> Vector:
    """J' x times the scale that brings J qd nearest to x: x'JJ'x / |JJ'x|^2 (Wolovich and Elliott 1984)."""
    rates = jacobian.T @ velocity
    reached = jacobian @ rates
    squared = reached @ reached
    moves = squared > 0
    return jnp.where(moves, velocity @ reached / jnp.where(moves, squared, 1.0), 0.0) * rates


def damping_for(
    method: str, jacobian: Matrix, lambda_max: Scalar, epsilon: Scalar, damping: Scalar, threshold: Scalar
) -> Damping:
    """The damping of a method's filtered inverse for a matrix (m, n); of `transpose`, none."""
    if method == ADAPTIVE:
        return raised_cosine(lambda_max, epsilon)
    if method == DAMPED:
        return constant(damping)
    if method == MANIPULABILITY:
        return constant(manipulability_damping(jacobian, damping, threshold))
    return constant(0.0)


def rates_and_values(
    method: str, jacobian: Matrix, velocity: Array, damping: Damping
) -> tuple[Array, Vector]:
    """Joint rates (n,) of a method for a task velocity (m,), or (n, c) for several of them, (m, c); singular values."""
    if method != TRANSPOSE:
        inverse, sigma = inverse_and_values(jacobian, damping)
        return inverse @ velocity, sigma
    sigma = singular_values(jacobian)
    if velocity.ndim == 1:
        return transposed_rates(jacobian, velocity), sigma
    return jax.vmap(transposed_rates, (None, 1), 1)(jacobian, velocity), sigma


def rate_solution(method: str, jacobian: Matrix, velocity: Array, damping: Damping) -> Array:
    """The same without the singular values."""
    return rates_and_values(method, jacobian, velocity, damping)[0]
