"""Poses as a user gives them, checked, and the way from one attitude to another."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.spatial.euler import euler_to_quaternion
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_rotation_vector
from jffsr.types import Quaternion, Vector3

GivenPose = tuple[Sequence[float], Sequence[float]]
"""Position (3,), m, and attitude: a unit quaternion (4,), or three Euler angles, rad, in a named order."""

_UNIT = 1e-6
_HALF_TURN = 1e-12


def checked_vector(value: Sequence[float], size: int, what: str) -> np.ndarray:
    """The numbers (size,) if there are so many and all are finite; else InputError."""
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError):
        vector = np.array(np.nan)
    if vector.shape != (size,) or not np.all(np.isfinite(vector)):
        raise InputError(f"{what} is {_shown(value)}; {size} finite numbers are expected")
    return vector


def checked_quaternion(value: Sequence[float], what: str) -> np.ndarray:
    """The quaternion (4,), (w, x, y, z), normalised; InputError if its length is off one by more than 1e-6."""
    q = checked_vector(value, 4, what)
    length = np.linalg.norm(q)
    if abs(length - 1) > _UNIT:
        raise InputError(f"{what} {_shown(value)} has the length {length:.9g}; a unit quaternion is expected")
    return q / length


def checked_attitude(value: Sequence[float], order: str | None, what: str) -> np.ndarray:
    """Quaternion (4,) of a given one, or of Euler angles (3,), rad, if their order is named."""
    if order is None:
        return checked_quaternion(value, f"{what} (w, x, y, z; angles need a named order)")
    return np.asarray(euler_to_quaternion(checked_vector(value, 3, f"{what} (angles {order})"), order))


def checked_pose(pose: GivenPose, order: str | None, what: str) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,), m, and quaternion (4,) of a given pose; InputError names `what` is wrong."""
    try:
        position, attitude = pose
    except (TypeError, ValueError):
        raise InputError(f"{what} is {_shown(pose)}; a pair of position and attitude is expected") from None
    return checked_vector(position, 3, f"{what} position"), checked_attitude(
        attitude, order, f"{what} attitude"
    )


def checked_poses(
    poses: Sequence[GivenPose], order: str | None, least: int, what: str
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (k, 3), m, and quaternions (k, 4) of at least `least` given poses."""
    if len(poses) < least:
        raise InputError(f"{len(poses)} {what}s are given; at least {least} are expected")
    pairs = [checked_pose(pose, order, f"{what} {i}") for i, pose in enumerate(poses)]
    return np.stack([p for p, _ in pairs]), np.stack([q for _, q in pairs])


def checked_positive(value: float, what: str, unit: str) -> np.ndarray:
    """The number, if it is positive and finite."""
    if not (np.ndim(value) == 0 and 0 < value < np.inf):
        raise InputError(f"{what} is {_shown(value)} {unit}; it must be positive and finite")
    return np.array(value, dtype=float)


def _shown(value: object) -> str:
    return str(value.tolist() if isinstance(value, np.ndarray) else value)


def shortest_turn(start: Quaternion, goal: Quaternion) -> Vector3:
    """Rotation vectors (..., 3), rad, resolved in I, of the shortest turn from attitude to attitude (..., 4).

    The signs of the quaternions do not matter, not even at 180 degrees, where the turn whose vector has a positive
    largest component is taken of the two; gradients are finite there and at no turn.
    """
    relative = quaternion_multiply(goal, quaternion_conjugate(start))
    vector = relative[..., 1:]
    largest = jnp.take_along_axis(vector, jnp.argmax(jnp.abs(vector), axis=-1, keepdims=True), axis=-1)
    half_turn = jnp.abs(relative[..., :1]) < _HALF_TURN
    relative = jnp.where(half_turn & (largest < 0), -relative, relative)
    # Its sign is settled, so that a real part of rounding alone must not turn it again.
    real = jnp.where(half_turn, jnp.abs(relative[..., :1]), relative[..., :1])
    return quaternion_to_rotation_vector(jnp.concatenate([real, relative[..., 1:]], axis=-1))
