"""Rotations as unit quaternions (w, x, y, z), matrices and rotation vectors.

Formulas are the textbook ones (Shuster, "A survey of attitude representations", 1993) in the Hamilton
convention; R and q turn vectors of the body frame into the parent frame.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.spatial.safe import safe_atan2
from jffsr.types import Array, Matrix3, Quaternion, Vector3

# Below this squared length of the vector part the series of atan is exact to rounding (error n^4/5).
_SMALL_SQUARED = 1e-10


def quaternion_multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product a b of two quaternions, shape (..., 4): first b, then a."""
    aw, ax, ay, az = jnp.moveaxis(a, -1, 0)
    bw, bx, by, bz = jnp.moveaxis(b, -1, 0)
    return jnp.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def quaternion_conjugate(q: Quaternion) -> Quaternion:
    """Inverse of a unit quaternion, shape (..., 4)."""
    return q * jnp.array([1.0, -1.0, -1.0, -1.0], dtype=q.dtype)


def quaternion_to_matrix(q: Quaternion) -> Matrix3:
    """Rotation matrix (..., 3, 3) of a unit quaternion (..., 4)."""
    w, x, y, z = jnp.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=-2)


def matrix_to_quaternion(rotation: Matrix3) -> Quaternion:
    """Unit quaternion (4,) with w >= 0 of a rotation matrix (3, 3); differentiable at every rotation.

    The matrix 4 q q' is linear in R; its row with the largest diagonal element is a multiple of q and is
    never shorter than 2, so the division is safe (Shepperd 1978).
    """
    r = rotation
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    wx, wy, wz = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, xz, yz = r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1]
    outer = jnp.array(
        [
            [1 + trace, wx, wy, wz],
            [wx, 1 + 2 * r[0, 0] - trace, xy, xz],
            [wy, xy, 1 + 2 * r[1, 1] - trace, yz],
            [wz, xz, yz, 1 + 2 * r[2, 2] - trace],
        ]
    )
    row = outer[jnp.argmax(jnp.diagonal(outer))]
    q = row / jnp.sqrt(jnp.sum(row * row))
    return jnp.where(q[0] < 0, -q, q)


def rotation_vector_to_quaternion(vector: Vector3) -> Quaternion:
    """Unit quaternion (..., 4) of the rotation by |vector| rad about vector (..., 3); smooth at zero."""
    squared = jnp.sum(vector * vector, axis=-1, keepdims=True)
    small = squared < _SMALL_SQUARED
    angle = jnp.sqrt(jnp.where(small, 1.0, squared))
    scale = jnp.where(small, 0.5 - squared / 48, jnp.sin(angle / 2) / angle)
    cosine = jnp.where(small, 1 - squared / 8, jnp.cos(angle / 2))
    return jnp.concatenate([cosine, scale * vector], axis=-1)


def quaternion_to_rotation_vector(q: Quaternion) -> Vector3:
    """Rotation vector (..., 3), rad, of length at most pi, of a unit quaternion (..., 4).

    Smooth at zero rotation. At 180 degrees the vector jumps between two opposite values, as any such
    chart must; value and gradient are those of one side.
    """
    q = jnp.where(q[..., :1] < 0, -q, q)
    return _rotation_vector(q[..., :1], q[..., 1:])


def rounded_rotation_vector(q: Quaternion, width: Array) -> Vector3:
    """Rotation vector (..., 3), rad, whose length is rounded off where it peaks, at 180 degrees.

    Over a width of the half angle, rad; 180 degrees give pi - 2 width. The sign jumps there as before, so
    what does not depend on the sign, such as the length, is differentiable at every rotation.
    """
    q = jnp.where(q[..., :1] < 0, -q, q)
    w = q[..., :1]
    return _rotation_vector(jnp.sqrt(w * w + width**2), q[..., 1:])


def _rotation_vector(w: Array, v: Vector3) -> Vector3:
    squared = jnp.sum(v * v, axis=-1, keepdims=True)
    small = squared < _SMALL_SQUARED
    length = jnp.sqrt(jnp.where(small, 1.0, squared))
    w_small = jnp.where(small, w, 1.0)
    series = 2 / w_small * (1 - squared / (3 * w_small**2))
    return jnp.where(small, series, 2 * jnp.arctan2(length, w) / length) * v


def axis_angle_to_matrix(axis: Vector3, angle: Array) -> Matrix3:
    """Rotation matrix (3, 3) by `angle` rad about the unit vector `axis` (Rodrigues)."""
    c, s = jnp.cos(angle), jnp.sin(angle)
    x, y, z = axis[0], axis[1], axis[2]
    v = 1 - c
    return jnp.array(
        [
            [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [x * y * v + z * s, c + y * y * v, y * z * v - x * s],
            [x * z * v - y * s, y * z * v + x * s, c + z * z * v],
        ]
    )


def quaternion_to_euler_zxy(q: Quaternion) -> Vector3:
    """Angles (..., 3) about z, x, y, rad, with R = Rz(a) Rx(b) Ry(c): the attitude angles of Li 2022.

    At b = +-90 degrees the other two are not unique; value and gradient stay finite there.
    """
    r = quaternion_to_matrix(q)
    cosine = jnp.sqrt(jnp.maximum(r[..., 0, 1] ** 2 + r[..., 1, 1] ** 2, 1e-24))
    about_z = safe_atan2(-r[..., 0, 1], r[..., 1, 1])
    about_x = jnp.arctan2(r[..., 2, 1], cosine)
    about_y = safe_atan2(-r[..., 2, 0], r[..., 2, 2])
    return jnp.stack([about_z, about_x, about_y], axis=-1)


def frame_along(axis: Vector3) -> Matrix3:
    """Rotation matrices (..., 3, 3) whose third column points along `axis` (..., 3), of any length.

    Which of them is of no account; it jumps where the axis's z changes sign (Duff et al., "Building an
    orthonormal basis, revisited", 2017), so use it only where any of them gives the same.
    """
    # Off unit length the columns would not be orthogonal, and the choice would show.
    axis = axis / jnp.sqrt(jnp.sum(axis * axis, axis=-1, keepdims=True))
    x, y, z = jnp.moveaxis(axis, -1, 0)
    sign = jnp.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    first = jnp.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=-1)
    second = jnp.stack([b, sign + y * y * a, -y], axis=-1)
    return jnp.stack([first, second, axis], axis=-1)
