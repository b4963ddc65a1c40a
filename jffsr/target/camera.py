"""A camera that measures the pose of a target's marker frame, with noise, delay, dropouts and outliers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from jffsr.target.body import Target
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.target_state import TargetState
from jffsr.types import Array, Quaternion, Vector3


@dataclass(frozen=True)
class Camera:
    """What a camera's poses are worth; the numbers of the standard noise are the defaults.

    rate, Hz; position_deviation, m, and attitude_deviation, rad, one standard deviation on each axis; delay, s, from
    exposure to delivery; dropouts and outliers, shares of the exposures in [0, 1), that give nothing and that have
    outlier_factor times the deviation. Raises InputError for numbers that make no sense.
    """

    rate: float = 10.0
    position_deviation: float = 0.01
    attitude_deviation: float = float(np.deg2rad(2.0))
    delay: float = 0.2
    dropouts: float = 0.05
    outliers: float = 0.02
    outlier_factor: float = 10.0

    def __post_init__(self):
        for what in ("rate", "position_deviation", "attitude_deviation", "outlier_factor"):
            value = getattr(self, what)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"camera: {what} is {value:g}; a positive number is expected")
        if not (np.isfinite(self.delay) and self.delay >= 0):
            raise InputError(f"camera: delay is {self.delay:g} s; zero or more is expected")
        for what in ("dropouts", "outliers"):
            if not 0 <= getattr(self, what) < 1:
                raise InputError(f"camera: {what} is {getattr(self, what):g}; a share in [0, 1) is expected")

    def scaled(self, factor: float) -> Camera:
        """The same camera with `factor` times the noise."""
        return replace(
            self,
            position_deviation=factor * self.position_deviation,
            attitude_deviation=factor * self.attitude_deviation,
        )

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (6, 6) of position, m, and attitude error in the measured frame, rad."""
        return np.diag(np.repeat([self.position_deviation**2, self.attitude_deviation**2], 3))


@register_dataclass
@dataclass(frozen=True, eq=False)
class Measurements:
    """Poses of the marker frame, sample by sample.

    time (N,), s, of exposure, equally spaced; position (N, 3), m, and quaternion (N, 4) in the camera's frame or in I;
    seen (N,), false where there is none. A pose is to hand only the camera's delay after its exposure.
    """

    time: Array
    position: Array
    quaternion: Array
    seen: Array

    def in_inertial(self, camera_position: Array, camera_quaternion: Array) -> Measurements:
        """The poses in I, from those in a camera's frame at positions (3,) or (N, 3), m, and quaternions (4,) or
        (N, 4), camera to I, at the times of exposure. Equal deviations on all axes stay what they are."""
        rotation = quaternion_to_matrix(jnp.asarray(camera_quaternion))
        turned = jnp.einsum("...ij,...j->...i", rotation, self.position)
        turn = jnp.broadcast_to(jnp.asarray(camera_quaternion), self.quaternion.shape)
        quaternion = quaternion_multiply(turn, self.quaternion)
        return replace(self, position=camera_position + turned, quaternion=quaternion)


def observe_target(
    target: Target,
    states: TargetState,
    camera: Camera,
    key: Array,
    camera_position: Array | None = None,
    camera_quaternion: Array | None = None,
) -> Measurements:
    """What the camera measures of a target in the states (N, ...) at `sample_times`, random from the key.

    In the frame of a camera at positions (3,) or (N, 3) and quaternions (4,) or (N, 4), or in I where none are given.
    Noise is normal, on each axis of the camera's frame for the position and as a rotation vector in the marker's frame.
    """
    count = states.position.shape[0]
    position, quaternion, _ = jax.vmap(
        lambda s: fixed_frame(s, target.marker_position, target.marker_quaternion)
    )(states)
    if camera_position is not None:
        position, quaternion = _seen_from(camera_position, camera_quaternion, position, quaternion)
    of_position, of_attitude, of_outlier, of_dropout = jax.random.split(key, 4)
    outlier = jax.random.uniform(of_outlier, (count, 1)) < camera.outliers
    larger = jnp.where(outlier, camera.outlier_factor, 1.0)
    turn = larger * camera.attitude_deviation * jax.random.normal(of_attitude, (count, 3))
    return Measurements(
        time=sample_times(camera, count),
        position=position + larger * camera.position_deviation * jax.random.normal(of_position, (count, 3)),
        quaternion=quaternion_multiply(quaternion, rotation_vector_to_quaternion(turn)),
        seen=jax.random.uniform(of_dropout, (count,)) >= camera.dropouts,
    )


def sample_times(camera: Camera, count: int) -> Array:
    """Times (count,), s, of the exposures, from zero at the camera's rate."""
    return jnp.arange(count) / camera.rate


def _seen_from(
    camera_position: Vector3, camera_quaternion: Quaternion, position: Array, quaternion: Array
) -> tuple[Array, Array]:
    """Positions (N, 3) and quaternions (N, 4) in I, in the camera's frame."""
    back = jnp.broadcast_to(quaternion_conjugate(jnp.asarray(camera_quaternion)), quaternion.shape)
    away = jnp.einsum("...ij,...j->...i", quaternion_to_matrix(back), position - camera_position)
    return away, quaternion_multiply(back, quaternion)
