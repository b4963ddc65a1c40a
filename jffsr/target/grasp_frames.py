"""Pose, twist and acceleration of a frame that is fixed to a target, over its motion."""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.spatial.rotation import quaternion_multiply, quaternion_to_matrix
from jffsr.target.body import Target
from jffsr.target.euler_series import rate_of_change
from jffsr.target.target_state import TargetState
from jffsr.types import Matrix3, Quaternion, Twist, Vector3


def fixed_frame(
    state: TargetState, position_T: Vector3, quaternion_T: Quaternion
) -> tuple[Vector3, Quaternion, Twist]:
    """Origin (3,), m, quaternion (4,), and twist (6,), [linear; angular], in I, of a frame given in T."""
    rotation = quaternion_to_matrix(state.quaternion)
    arm, rate = rotation @ position_T, rotation @ state.angular_velocity_T
    twist = jnp.concatenate([state.velocity + jnp.cross(rate, arm), rate])
    return state.position + arm, quaternion_multiply(state.quaternion, jnp.asarray(quaternion_T)), twist


def grasp_frame(
    target: Target, state: TargetState, grasp: str | None = None
) -> tuple[Vector3, Quaternion, Twist]:
    """Origin (3,), m, quaternion (4,), G to I, and twist (6,), [linear; angular], in I, of a grasp frame by name.

    None is the first. Raises InputError for a name that the target does not have.
    """
    index = target.grasp_index(grasp)
    return fixed_frame(
        state, jnp.asarray(target.grasp_position)[index], jnp.asarray(target.grasp_quaternion)[index]
    )


def fixed_acceleration(inertia: Matrix3, state: TargetState, position_T: Vector3) -> Twist:
    """Acceleration (6,), [linear; angular], m/s^2 and rad/s^2, in I, of a point (3,) of a body without torque."""
    rotation, rate = quaternion_to_matrix(state.quaternion), state.angular_velocity_T
    change = rate_of_change(jnp.asarray(inertia), rate)
    linear = jnp.cross(change, position_T) + jnp.cross(rate, jnp.cross(rate, position_T))
    return jnp.concatenate([rotation @ linear, rotation @ change])
