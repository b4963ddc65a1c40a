"""The two steps of the multiplicative extended Kalman filter: on in time, and correction by a measured pose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.spatial.inertia import skew
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
)
from jffsr.target.estimate import (
    ATTITUDE,
    INERTIA,
    NUM_ERRORS,
    OFFSET,
    POSITION,
    RATE,
    VELOCITY,
    TargetEstimate,
    corrected,
)
from jffsr.target.euler_series import rotate_freely
from jffsr.target.inertia_parameters import inertia_from_parameters
from jffsr.types import Array, Matrix, Matrix3, Scalar


@dataclass(frozen=True)
class ProcessNoise:
    """White accelerations of a target and random walks of its constants, as the roots of their densities of power.

    angular_acceleration, rad/s^2/sqrt(Hz); linear_acceleration, m/s^2/sqrt(Hz); inertia, of the five numbers,
    1/sqrt(s); offset, m/sqrt(s). A free rigid body has none of them, and zero is the default; give some where sunlight,
    gravity gradient or sloshing fuel act.
    """

    angular_acceleration: float = 0.0
    linear_acceleration: float = 0.0
    inertia: float = 0.0
    offset: float = 0.0

    def __post_init__(self):
        for what in ("angular_acceleration", "linear_acceleration", "inertia", "offset"):
            value = getattr(self, what)
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"process noise: {what} is {value:g}; zero or more is expected")

    def covariance(self, duration: Scalar) -> Matrix:
        """What they add to the covariance (20, 20) over a short `duration`, s."""
        added = jnp.zeros((NUM_ERRORS, NUM_ERRORS))
        eye = jnp.eye(3)
        for power, place, rate in (
            (self.angular_acceleration**2, ATTITUDE, RATE),
            (self.linear_acceleration**2, POSITION, VELOCITY),
        ):
            added = added.at[place, place].set(power * duration**3 / 3 * eye)
            added = added.at[place, rate].set(power * duration**2 / 2 * eye)
            added = added.at[rate, place].set(power * duration**2 / 2 * eye)
            added = added.at[rate, rate].set(power * duration * eye)
        added = added.at[INERTIA, INERTIA].set(self.inertia**2 * duration * jnp.eye(5))
        return added.at[OFFSET, OFFSET].set(self.offset**2 * duration * eye)


def advance(estimate: TargetEstimate, duration: Scalar, order: int) -> tuple[TargetEstimate, Matrix]:
    """The estimate `duration` s later, covariance as before, and the transition matrix (20, 20) of its errors.

    One step of the Taylor series of this order: exact where the turn is a small part of a radian.
    """

    rotation = quaternion_to_matrix(estimate.quaternion)

    def turn(rate: Array, parameters: Array, offset: Array) -> tuple[Array, Array, Array, Array]:
        """Turn, new rate, and what circling adds to the marker's position and velocity, in T as it was."""
        new_rate, turned = rotate_freely(inertia_from_parameters(parameters), rate, duration, order)
        there = quaternion_to_matrix(turned)
        around = jnp.cross(rate, offset)
        moved = there @ offset - offset - duration * around
        return turned, new_rate, moved, there @ jnp.cross(new_rate, offset) - around

    unknowns = (estimate.angular_velocity_T, estimate.inertia_parameters, estimate.marker_offset_T)
    turned, rate, moved, sped = turn(*unknowns)
    back = quaternion_conjugate(turned)

    def small_changes(*unknowns: Array) -> tuple[Array, Array, Array, Array]:
        new_turn, new_rate, new_moved, new_sped = turn(*unknowns)
        small = 2 * quaternion_multiply(back, new_turn)[1:]
        return small, new_rate, rotation @ new_moved, rotation @ new_sped

    derivatives = jax.jacfwd(small_changes, argnums=(0, 1, 2))(*unknowns)
    transition = jnp.eye(NUM_ERRORS)
    transition = transition.at[ATTITUDE, ATTITUDE].set(quaternion_to_matrix(turned).T)
    for rows, of_rows in zip((ATTITUDE, RATE, POSITION, VELOCITY), derivatives, strict=True):
        for columns, block in zip((RATE, INERTIA, OFFSET), of_rows, strict=True):
            transition = transition.at[rows, columns].set(block)
    transition = transition.at[POSITION, VELOCITY].set(duration * jnp.eye(3))
    transition = transition.at[POSITION, ATTITUDE].set(-rotation @ skew(moved))
    transition = transition.at[VELOCITY, ATTITUDE].set(-rotation @ skew(sped))
    quaternion = quaternion_multiply(estimate.quaternion, turned)
    later = replace(
        estimate,
        time=estimate.time + duration,
        quaternion=quaternion / jnp.sqrt(jnp.sum(quaternion * quaternion)),
        angular_velocity_T=rate,
        marker_position=estimate.marker_position + duration * estimate.marker_velocity + rotation @ moved,
        marker_velocity=estimate.marker_velocity + rotation @ sped,
    )
    return later, transition


def predict_step(
    estimate: TargetEstimate, duration: Scalar, added: Matrix | float, order: int
) -> TargetEstimate:
    """The estimate `duration` s later with its covariance, to which a matrix (20, 20) of disturbances is added."""
    moved, transition = advance(estimate, duration, order)
    grown = transition @ estimate.covariance @ transition.T + added
    return replace(moved, covariance=grown)


MEASURED = np.eye(NUM_ERRORS)[np.r_[POSITION, ATTITUDE]]
"""Derivative (6, 20) of a measured pose by the errors: position and attitude of the marker are parts of the state."""


def innovation(estimate: TargetEstimate, position: Array, quaternion: Array) -> Array:
    """Measured less expected pose (6,), [m in I; rad in T]."""
    turn = quaternion_multiply(quaternion_conjugate(estimate.quaternion), quaternion)
    return jnp.concatenate([position - estimate.marker_position, quaternion_to_rotation_vector(turn)])


def update_step(
    estimate: TargetEstimate,
    position: Array,
    quaternion: Array,
    seen: Array,
    noise: Matrix,
    gate: float,
) -> tuple[TargetEstimate, Array, Scalar, Array]:
    """Correction by a pose with noise of covariance (6, 6), unless it was not seen or is beyond the gate.

    Returns the estimate, the innovation (6,), its normalised square and whether the pose was used.
    """
    residual = innovation(estimate, position, quaternion)
    cross = estimate.covariance @ MEASURED.T
    of_residual = MEASURED @ cross + noise
    solved = jnp.linalg.solve(of_residual, jnp.concatenate([residual[:, None], cross.T], axis=1))
    squared = residual @ solved[:, 0]
    used = seen & (squared <= gate)
    gain = solved[:, 1:].T
    kept = jnp.eye(NUM_ERRORS) - gain @ MEASURED
    # Joseph's form stays positive definite under rounding.
    covariance = kept @ estimate.covariance @ kept.T + gain @ noise @ gain.T
    error = gain @ residual
    # The error's rotation vector is now about the corrected attitude.
    reset = jnp.eye(NUM_ERRORS).at[ATTITUDE, ATTITUDE].set(_right_jacobian(error[ATTITUDE]))
    covariance = reset @ covariance @ reset.T
    new = replace(corrected(estimate, error), covariance=(covariance + covariance.T) / 2)
    chosen = jax.tree.map(lambda a, b: jnp.where(used, a, b), new, estimate)
    return chosen, residual, squared, used


def _right_jacobian(vector: Array) -> Matrix3:
    """Derivative of the rotation vector about a rotation by that about none; to second order."""
    across = skew(vector)
    return jnp.eye(3) - across / 2 + across @ across / 6
