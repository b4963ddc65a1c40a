"""Poses made of the turns and moves between others, each taken in part: the cumulative form of Kim, Kim, Shin (1995).

p = p_0 + sum_i b_i (p_i - p_(i-1)),    q = q_0 exp(b_1 w_1) exp(b_2 w_2) ...,    w_i = log(q_(i-1)* q_i).

The basis b_i, between 0 and 1, is that of rounded steps for waypoints and the cumulative B-spline for splines; both
leave only a few of the b_i off 0 and 1 at any place, and only those are multiplied out.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, rotation_vector_to_quaternion
from jffsr.trajectories.cartesian.poses import shortest_turn
from jffsr.types import Array, Quaternion, Scalar, Vector, Vector3


def turns_between(quaternions: Array) -> Array:
    """Rotation vectors (k - 1, 3), rad, in the turned frame, of the shortest turns from each attitude (k, 4) on."""
    inverse = quaternion_conjugate(quaternions)
    return shortest_turn(inverse[1:], inverse[:-1])


def partial_pose(
    positions: Array, quaternions: Array, parts: Vector, first: Scalar, count: int
) -> tuple[Vector3, Quaternion]:
    """Position (3,), m, and attitude (4,) from poses (k, 3) and (k, 4) and the part (k - 1,) done of each step.

    Only the `count` steps from `first` on are under way: those before are done, those behind not begun.
    """
    positions = jax.lax.dynamic_slice_in_dim(positions, first, count + 1)
    quaternions = jax.lax.dynamic_slice_in_dim(quaternions, first, count + 1)
    parts = jax.lax.dynamic_slice_in_dim(parts, first, count)
    turns = rotation_vector_to_quaternion(parts[:, None] * turns_between(quaternions))
    attitude = quaternions[0]
    for i in range(count):
        attitude = quaternion_multiply(attitude, turns[i])
    return positions[0] + parts @ (positions[1:] - positions[:-1]), attitude


def combined_lengths(positions: Array, quaternions: Array, metres_per_radian: Array) -> Vector:
    """Lengths (k - 1,), m, of the steps between poses: sqrt(distance^2 + (metres_per_radian angle)^2)."""
    moves = jnp.asarray(positions)[1:] - jnp.asarray(positions)[:-1]
    turns = turns_between(jnp.asarray(quaternions))
    return jnp.sqrt(jnp.sum(moves**2, axis=1) + metres_per_radian**2 * jnp.sum(turns**2, axis=1))
