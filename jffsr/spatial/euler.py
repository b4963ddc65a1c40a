"""Quaternions from Euler angles and back, for every order of axes, named as SciPy's `Rotation` names them.

Three letters name an order: in upper case about the axes that turn with the body ("ZYX": R = Rz(a) Ry(b) Rx(c)), in
lower case about fixed axes ("xyz": R = Rz(c) Ry(b) Rx(a)). A minus before them turns the signs of all three angles.
As (Rx(a) Ry(b) Rz(c))' = Rz(-c) Ry(-b) Rx(-a), the reading of Wu et al. 2018, whose angles are those of the transposed
matrix of the tool, is the order "-xyz".
"""

from __future__ import annotations

from itertools import product

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.spatial.rotation import quaternion_multiply
from jffsr.spatial.safe import safe_sqrt
from jffsr.types import Array, Quaternion, Vector3

EULER_ORDERS = tuple(
    "".join(letters)
    for axes in ("XYZ", "xyz")
    for letters in product(axes, repeat=3)
    if letters[0] != letters[1] != letters[2]
)
"""The 24 orders; each may have a minus before it."""

# Closer to gimbal lock, in half an angle, rad, the two outer angles are no longer told apart.
_LOCKED = 1e-7


def euler_to_quaternion(angles: Vector3, order: str) -> Quaternion:
    """Unit quaternions (..., 4) of Euler angles (..., 3), rad, in an order such as "ZYX", "xyz" or "-xyz".

    Raises InputError for an order that is none of the 24, with or without a minus.
    """
    sign, axes, extrinsic = _read(order)
    half = 0.5 * sign * jnp.asarray(angles)
    turns = [_about(axis, half[..., i]) for i, axis in enumerate(axes)]
    first, second, third = reversed(turns) if extrinsic else turns
    return quaternion_multiply(quaternion_multiply(first, second), third)


def quaternion_to_euler(q: Quaternion, order: str) -> Vector3:
    """Euler angles (..., 3), rad, of unit quaternions (..., 4): the middle one in [-pi/2, pi/2] or, where the first
    axis is the last one again, in [0, pi], the others in [-pi, pi].

    At gimbal lock the third angle is zero, as in SciPy, and value and gradient are finite. Raises InputError for an
    unknown order.

    About i, j and i again the quaternion is cos(b/2) (cos S + i sin S) + sin(b/2) (cos D + i sin D) j with
    S = (a + c)/2 and D = (a - c)/2: two polar forms. Three different axes i, j, k come down to that by a quarter turn
    about j, which takes i to k or to -k (the idea of Bernardes and Viollet 2022).
    """
    sign, axes, extrinsic = _read(order)
    i, j, k = reversed(axes) if extrinsic else axes
    parity = _parity(i, j)
    repeated = i == k
    if not repeated:
        q = quaternion_multiply(q, _about(j, jnp.full(q.shape[:-1], np.pi / 4, q.dtype)))
    other = 3 - i - j
    real, about_i, about_j, about_other = q[..., 0], q[..., 1 + i], q[..., 1 + j], parity * q[..., 1 + other]
    upright, tilted = safe_sqrt(real**2 + about_i**2), safe_sqrt(about_j**2 + about_other**2)
    middle = 2 * jnp.arctan2(tilted, upright)
    no_sum, no_difference = upright < _LOCKED, tilted < _LOCKED
    half_sum = _angle(about_i, real, no_sum)
    half_difference = _angle(about_other, about_j, no_difference)
    # What is undefined makes the third angle zero: the last turn, or the first one about fixed axes.
    zero = -1.0 if extrinsic else 1.0
    half_sum, half_difference = (
        jnp.where(no_sum, zero * half_difference, half_sum),
        jnp.where(no_difference, zero * half_sum, half_difference),
    )
    first, last = _wrapped(half_sum + half_difference), half_sum - half_difference
    last = _wrapped(last if repeated else -parity * last)
    middle = middle if repeated else middle - np.pi / 2
    found = [last, middle, first] if extrinsic else [first, middle, last]
    return sign * jnp.stack(found, axis=-1)


def _read(order: str) -> tuple[float, list[int], bool]:
    """Sign, numbers of the axes, and whether they are fixed."""
    letters = order.removeprefix("-") if isinstance(order, str) else order
    if letters not in EULER_ORDERS:
        raise InputError(
            f"Euler order {order!r} is unknown: three of XYZ (turning axes) or of xyz (fixed axes), neighbours "
            f"different, are expected, such as 'ZYX', 'xyz' or '-xyz' (signs turned)"
        )
    return (-1.0 if order[0] == "-" else 1.0), ["xyz".index(x) for x in letters.lower()], letters.islower()


def _parity(i: int, j: int) -> float:
    """1 if i x j is the third axis, -1 if it is its opposite."""
    return 1.0 if (j - i) % 3 == 1 else -1.0


def _about(axis: int, half: Array) -> Quaternion:
    """Quaternion (..., 4) of a turn by twice `half` about a coordinate axis."""
    sine, zero = jnp.sin(half), jnp.zeros_like(half)
    return jnp.stack([jnp.cos(half), *(sine if axis == i else zero for i in range(3))], axis=-1)


def _angle(y: Array, x: Array, undefined: Array) -> Array:
    """Angle of (x, y), zero with zero gradient where it is undefined."""
    return jnp.where(undefined, 0.0, jnp.arctan2(y, jnp.where(undefined, 1.0, x)))


def _wrapped(angle: Array) -> Array:
    """The angle in (-pi, pi], of one in (-2 pi, 2 pi]."""
    return jnp.where(angle > np.pi, angle - 2 * np.pi, jnp.where(angle <= -np.pi, angle + 2 * np.pi, angle))
