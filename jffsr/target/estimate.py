"""What a filter believes of a target: its motion, inertia ratios and marker, with the covariance of their errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)
from jffsr.target.body import Target
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.inertia_parameters import inertia_ratios, parameters_from_inertia
from jffsr.target.target_state import TargetState
from jffsr.types import Array, Quaternion, Vector3

# Places in the error vector.
ATTITUDE, RATE, INERTIA = slice(0, 3), slice(3, 6), slice(6, 11)
POSITION, VELOCITY, OFFSET = slice(11, 14), slice(14, 17), slice(17, 20)
NUM_ERRORS = 20


@register_dataclass
@dataclass(frozen=True, eq=False)
class TargetEstimate:
    """An estimate of a target at a time; leading batch axes are allowed.

    Here T has its origin in the centre of mass and the axes of the measured marker frame, whose attitude to the
    principal axes is unknown. time (), s; quaternion (4,), T to I; angular_velocity_T (3,), rad/s; inertia_parameters
    (5,) of the inertia in T; marker_position (3,), m, and marker_velocity (3,), m/s, in I; marker_offset_T (3,), m,
    from the centre of mass to the marker; covariance (20, 20) of the errors of all these in this order, the attitude's
    as a rotation vector in T.

    The marker stands here, not the centre of mass: what is measured is then a part of the state, and the product of two
    unknowns, rate and offset, enters only through accelerations. With the centre of mass in its place the same filter
    is far too sure of itself.
    """

    time: Array
    quaternion: Array
    angular_velocity_T: Array
    inertia_parameters: Array
    marker_position: Array
    marker_velocity: Array
    marker_offset_T: Array
    covariance: Array

    @property
    def inertia_ratios(self) -> Vector3:
        """Principal moments of inertia (..., 3), ascending, as shares of the largest."""
        return inertia_ratios(self.inertia_parameters)

    @property
    def position(self) -> Vector3:
        """Position (..., 3), m, of the centre of mass in I."""
        return self.marker_position - _turned(self.quaternion, self.marker_offset_T)

    @property
    def velocity(self) -> Vector3:
        """Velocity (..., 3), m/s, of the centre of mass in I."""
        around = jnp.cross(self.angular_velocity_T, self.marker_offset_T)
        return self.marker_velocity - _turned(self.quaternion, around)

    @property
    def standard_deviation(self) -> Array:
        """Standard deviations (..., 20) of the errors, in the covariance's order."""
        return jnp.sqrt(jnp.diagonal(self.covariance, axis1=-2, axis2=-1))

    @property
    def state(self) -> TargetState:
        """Pose and velocity of T alone."""
        return TargetState(self.position, self.velocity, self.quaternion, self.angular_velocity_T)


def _turned(quaternion: Quaternion, vector: Vector3) -> Vector3:
    return jnp.einsum("...ij,...j->...i", quaternion_to_matrix(quaternion), vector)


def true_estimate(target: Target, state: TargetState, time: Array = 0.0) -> TargetEstimate:
    """The truth in an estimate's form: axes turned to the marker's, covariance zero. One state; vmap for more."""
    marker = jnp.asarray(target.marker_quaternion)
    rotation = quaternion_to_matrix(marker)
    position, quaternion, twist = fixed_frame(state, jnp.asarray(target.marker_position), marker)
    return TargetEstimate(
        time=jnp.asarray(time, rotation.dtype),
        quaternion=quaternion,
        angular_velocity_T=rotation.T @ state.angular_velocity_T,
        inertia_parameters=parameters_from_inertia(rotation.T @ target.inertia @ rotation),
        marker_position=position,
        marker_velocity=twist[:3],
        marker_offset_T=rotation.T @ target.marker_position,
        covariance=jnp.zeros((NUM_ERRORS, NUM_ERRORS), rotation.dtype),
    )


def corrected(estimate: TargetEstimate, error: Array) -> TargetEstimate:
    """The estimate moved by an error vector (20,): the attitude by a product, the rest by a sum."""
    turn = rotation_vector_to_quaternion(error[ATTITUDE])
    return replace(
        estimate,
        quaternion=quaternion_multiply(estimate.quaternion, turn),
        angular_velocity_T=estimate.angular_velocity_T + error[RATE],
        inertia_parameters=estimate.inertia_parameters + error[INERTIA],
        marker_position=estimate.marker_position + error[POSITION],
        marker_velocity=estimate.marker_velocity + error[VELOCITY],
        marker_offset_T=estimate.marker_offset_T + error[OFFSET],
    )


def error_of(estimate: TargetEstimate, truth: TargetEstimate) -> Array:
    """The error vector (20,) that takes the estimate to the truth."""
    turn = quaternion_multiply(quaternion_conjugate(estimate.quaternion), truth.quaternion)
    return jnp.concatenate(
        [
            quaternion_to_rotation_vector(turn),
            truth.angular_velocity_T - estimate.angular_velocity_T,
            truth.inertia_parameters - estimate.inertia_parameters,
            truth.marker_position - estimate.marker_position,
            truth.marker_velocity - estimate.marker_velocity,
            truth.marker_offset_T - estimate.marker_offset_T,
        ]
    )
