"""What is believed of a target before any pose has been measured."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.lumping import on_host, to_array
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.target.estimate import NUM_ERRORS, TargetEstimate, corrected
from jffsr.target.inertia_parameters import NUM_PARAMETERS, checked_parameters
from jffsr.types import Array, Matrix


@register_dataclass
@dataclass(frozen=True, eq=False)
class TargetPrior:
    """Means and standard deviations of what a camera does not see at once; position and attitude are wide open.

    angular_velocity_T (3,), rad/s, inertia_parameters (5,) and marker_offset_T (3,), m, in the axes of the marker;
    velocity (3,), m/s, of the centre of mass in I; a deviation for each, of all its components. A deviation of 0.05 of
    the inertia parameters spreads the second moments of mass by about a tenth either way. Much wider ones, or offsets
    of half a metre, make the filter too sure of itself: its errors are then no longer nearly normal.
    """

    angular_velocity_T: Array
    inertia_parameters: Array
    velocity: Array
    marker_offset_T: Array
    angular_velocity_deviation: Array
    inertia_deviation: Array
    velocity_deviation: Array
    offset_deviation: Array

    @classmethod
    def create(
        cls,
        angular_velocity_T: Array = (0.0, 0.0, 0.0),
        inertia: Array = (1.0, 1.0, 1.0),
        velocity: Array = (0.0, 0.0, 0.0),
        marker_offset_T: Array = (0.0, 0.0, 0.0),
        angular_velocity_deviation: float = float(np.deg2rad(2.5)),
        inertia_deviation: float = 0.05,
        velocity_deviation: float = 0.05,
        offset_deviation: float = 0.05,
    ) -> TargetPrior:
        """The checked prior: inertia (3, 3), or (3,) for its diagonal, in any unit.

        Raises InputError for inertia ratios that no rigid body has, and for a deviation that is not positive.
        """
        deviations = {
            "angular_velocity_deviation": angular_velocity_deviation,
            "inertia_deviation": inertia_deviation,
            "velocity_deviation": velocity_deviation,
            "offset_deviation": offset_deviation,
        }
        means = {
            "angular_velocity_T": angular_velocity_T,
            "velocity": velocity,
            "marker_offset_T": marker_offset_T,
        }
        means = {what: to_array(value) for what, value in means.items()}
        for what, value in means.items():
            numbers = on_host(value)
            if value.shape != (3,) or (numbers is not None and not np.all(np.isfinite(numbers[0]))):
                raise InputError(f"target prior: {what} is {value!r}; three finite numbers are expected")
        for what, value in deviations.items():
            numbers = on_host(to_array(value))
            if numbers is not None and not (np.isfinite(numbers[0]) and numbers[0] > 0):
                raise InputError(f"target prior: {what} is {numbers[0]:g}; a positive number is expected")
        return cls(inertia_parameters=checked_parameters("target prior", inertia), **means, **deviations)

    def at_pose(self, position: Array, quaternion: Array, time: Array) -> TargetEstimate:
        """The prior's means with the marker in this pose, (3,), m, and (4,), marker to I; without a covariance."""
        rotation = quaternion_to_matrix(jnp.asarray(quaternion))
        around = jnp.cross(jnp.asarray(self.angular_velocity_T), jnp.asarray(self.marker_offset_T))
        return TargetEstimate(
            time=jnp.asarray(time, float),
            quaternion=jnp.asarray(quaternion),
            angular_velocity_T=jnp.asarray(self.angular_velocity_T, float),
            inertia_parameters=jnp.asarray(self.inertia_parameters, float),
            marker_position=jnp.asarray(position),
            marker_velocity=self.velocity + rotation @ around,
            marker_offset_T=jnp.asarray(self.marker_offset_T, float),
            covariance=jnp.full((NUM_ERRORS, NUM_ERRORS), jnp.nan),
        )

    def normalised_residual(self, estimate: TargetEstimate) -> Array:
        """Prior means less an estimate's values (14,), each over its deviation: rate, inertia, velocity of the centre
        of mass, offset. Half its square is the negative logarithm of the prior's density."""
        return jnp.concatenate(
            [
                (self.angular_velocity_T - estimate.angular_velocity_T) / self.angular_velocity_deviation,
                (self.inertia_parameters - estimate.inertia_parameters) / self.inertia_deviation,
                (self.velocity - estimate.velocity) / self.velocity_deviation,
                (self.marker_offset_T - estimate.marker_offset_T) / self.offset_deviation,
            ]
        )

    def derivative(self, estimate: TargetEstimate) -> Matrix:
        """Derivative (14, 20) of less the normalised residual by the estimate's errors."""
        return -jax.jacfwd(lambda error: self.normalised_residual(corrected(estimate, error)))(
            jnp.zeros(NUM_ERRORS)
        )


def draw_from_prior(prior: TargetPrior, key: Array, position: Array | float = 0.0) -> TargetEstimate:
    """A random truth that the prior allows, in an estimate's form: centre of mass at a position (3,), m, attitude
    uniform, covariance zero."""
    of_attitude, of_rest = jax.random.split(key)
    quaternion = jax.random.normal(of_attitude, (4,))
    quaternion = quaternion / jnp.sqrt(jnp.sum(quaternion * quaternion))
    rate, inertia, velocity, offset = jnp.split(
        jax.random.normal(of_rest, (14,)), np.cumsum([3, NUM_PARAMETERS, 3])
    )
    rate = prior.angular_velocity_T + prior.angular_velocity_deviation * rate
    offset = prior.marker_offset_T + prior.offset_deviation * offset
    rotation = quaternion_to_matrix(quaternion)
    velocity = prior.velocity + prior.velocity_deviation * velocity
    return TargetEstimate(
        time=jnp.zeros(()),
        quaternion=quaternion,
        angular_velocity_T=rate,
        inertia_parameters=prior.inertia_parameters + prior.inertia_deviation * inertia,
        marker_position=position + rotation @ offset,
        marker_velocity=velocity + rotation @ jnp.cross(rate, offset),
        marker_offset_T=offset,
        covariance=jnp.zeros((NUM_ERRORS, NUM_ERRORS)),
    )
