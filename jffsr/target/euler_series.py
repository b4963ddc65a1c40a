"""Torque-free rotation by Taylor series of high order: J w' = J w x w and q' = q (0, w)/2.

Both equations are quadratic, so every coefficient follows from the earlier ones by a convolution, exactly. Unlike
Jacobi's elliptic functions the series has no special cases: equal moments, spin about a principal axis, the
separatrix and a full inertia matrix are like any other, in value and in gradient. The nearest singularity of w in
complex time lies no nearer than about (pi/2)/|w|, so a step through a quarter of a radian at order 18 leaves rounding
alone.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.spatial.rotation import quaternion_multiply
from jffsr.types import Array, Matrix3, Quaternion, Vector3

ORDER = 18
LARGEST_ANGLE = 0.25
"""Largest turn of one step, rad, for which `ORDER` leaves rounding alone."""


def inverse_inertia(inertia: Matrix3) -> Matrix3:
    """Inverse (..., 3, 3) by cofactors: far quicker in batches than one library call for each matrix."""
    a, b, c = inertia[..., 0, :], inertia[..., 1, :], inertia[..., 2, :]
    columns = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)], axis=-1)
    return columns / jnp.sum(a * columns[..., 0], axis=-1)[..., None, None]


def rate_of_change(inertia: Matrix3, angular_velocity: Vector3) -> Vector3:
    """Angular acceleration (3,), rad/s^2, of a body without torque, by Euler's equation; all in body axes."""
    return inverse_inertia(inertia) @ jnp.cross(inertia @ angular_velocity, angular_velocity)


def rotation_series(inertia: Matrix3, angular_velocity: Vector3, order: int = ORDER) -> tuple[Array, Array]:
    """Taylor coefficients in time of the angular velocity, (order + 1, 3), and of the quaternion of the turn since
    time zero, (order + 1, 4), for an inertia (3, 3) and an angular velocity (3,), rad/s, at time zero in body axes."""
    inverse = inverse_inertia(inertia)
    places = jnp.eye(order + 1, dtype=angular_velocity.dtype)

    def first_of(x: Array) -> Array:
        return places[0][:, None] * x

    def newest_first(x: Array, series: Array) -> Array:
        return jnp.concatenate([x[None], series[:-1]])

    def extend(carry, k):
        w, momentum, q, w_back = carry
        torque = jnp.sum(jnp.cross(momentum, w_back), axis=0) / (k + 1)
        pure = jnp.concatenate([jnp.zeros_like(w_back[:, :1]), w_back], axis=-1)
        turned = jnp.sum(quaternion_multiply(q, pure), axis=0) / (2 * (k + 1))
        rate, place = inverse @ torque, places[k + 1][:, None]
        new = (w + place * rate, momentum + place * torque, q + place * turned, newest_first(rate, w_back))
        return new, None

    unturned = jnp.array([1.0, 0.0, 0.0, 0.0], angular_velocity.dtype)
    w = first_of(angular_velocity)
    start = (w, first_of(inertia @ angular_velocity), first_of(unturned), w)
    # A loop in the program instead of its terms written out: it compiles ten times as fast.
    (w, _, q, _), _ = jax.lax.scan(extend, start, jnp.arange(order))
    return w, q


def sum_series(w: Array, q: Array, time: Array) -> tuple[Vector3, Quaternion]:
    """Angular velocity (3,), rad/s, and unit quaternion (4,) of the turn, body now to body then, after `time` s."""
    powers = jnp.cumprod(jnp.concatenate([jnp.ones(1, w.dtype), jnp.full(w.shape[0] - 1, time, w.dtype)]))
    turn = powers @ q
    return powers @ w, turn / jnp.sqrt(jnp.sum(turn * turn))


def rotate_freely(
    inertia: Matrix3, angular_velocity: Vector3, time: Array, order: int = ORDER
) -> tuple[Vector3, Quaternion]:
    """One step of torque-free rotation: the angular velocity (3,) after `time` s and the turn (4,) meanwhile.

    The turn should not be much more than `LARGEST_ANGLE`.
    """
    return sum_series(*rotation_series(inertia, angular_velocity, order), time)
