"""What the tool is asked for: pose errors, the velocity that follows the target, and which directions count."""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
)
from jffsr.trajectories.cartesian.interface import ToolTarget
from jffsr.types import Array, Matrix, Quaternion, Scalar, Twist, Vector3

ALL, ROLL_FREE, POSITION = "all", "roll_free", "position"
FREEDOMS = (ALL, ROLL_FREE, POSITION)
TRACKED_DIRECTIONS = {ALL: 6, ROLL_FREE: 5, POSITION: 3}

_Z = (0.0, 0.0, 1.0)
# Below this squared sine the series of the angle over its sine is exact to rounding.
_SMALL_SQUARED = 1e-8


def rotation_between(goal: Quaternion, actual: Quaternion) -> Vector3:
    """Rotation vector (..., 3), rad, in I, of R_actual R_goal': what the attitude is off by."""
    return quaternion_to_rotation_vector(quaternion_multiply(actual, quaternion_conjugate(goal)))


def pose_error(
    position: Vector3, quaternion: Quaternion, goal_position: Vector3, goal_quaternion: Quaternion
) -> Array:
    """Pose less its goal (..., 6), in I: position, m, then the rotation vector of R R_goal', rad."""
    return jnp.concatenate([position - goal_position, rotation_between(goal_quaternion, quaternion)], axis=-1)


def pointing_error(quaternion: Quaternion, goal: Quaternion) -> Vector3:
    """Shortest rotation (3,), rad, in I, from the goal's z axis to the tool's, whatever their roll.

    Smooth where they agree; where they are opposite, its direction is not unique and it is zero.
    """
    z, wanted = (quaternion_to_matrix(q) @ jnp.array(_Z) for q in (quaternion, goal))
    cross, cosine = jnp.cross(wanted, z), wanted @ z
    squared = cross @ cross
    small = squared < _SMALL_SQUARED
    sine = jnp.sqrt(jnp.where(small, 1.0, squared))
    return jnp.where(small, 1 + squared / 6, jnp.arctan2(sine, cosine) / sine) * cross


def mean_twist(now: ToolTarget, later: ToolTarget, step: Scalar) -> Twist:
    """The constant twist (6,) in I that takes the target from its pose now to its pose `step` s later."""
    turn = rotation_between(now.quaternion, later.quaternion)
    return jnp.concatenate([later.position - now.position, turn]) / step


def tracked_rows(freedom: str, quaternion: Quaternion, values: Array) -> Array:
    """The tracked directions (k, ...) of twists or Jacobians (6, ...) in I; roll is about the tool's own z."""
    if freedom == ALL:
        return values
    if freedom == POSITION:
        return values[:3]
    across: Matrix = quaternion_to_matrix(quaternion)[:, :2].T
    return jnp.concatenate([values[:3], across @ values[3:]])


def tracked_error(
    freedom: str,
    position: Vector3,
    quaternion: Quaternion,
    goal_position: Vector3,
    goal_quaternion: Quaternion,
) -> Twist:
    """The pose error (6,) in I that feedback acts on: with the roll free, the attitude's is the pointing error."""
    if freedom == ALL:
        return pose_error(position, quaternion, goal_position, goal_quaternion)
    offset = position - goal_position
    turn = pointing_error(quaternion, goal_quaternion) if freedom == ROLL_FREE else jnp.zeros(3)
    return jnp.concatenate([offset, turn])
