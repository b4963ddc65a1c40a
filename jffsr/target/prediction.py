"""Where a grasp frame will be, how it will move, and how well that is known; when that is well enough."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import chi2

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.target.body import Frame
from jffsr.target.estimate import NUM_ERRORS, TargetEstimate, corrected
from jffsr.target.euler_series import ORDER
from jffsr.target.filter_steps import ProcessNoise, predict_step
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.inertia_parameters import inertia_from_parameters
from jffsr.target.tumbling import steps_needed
from jffsr.types import Array, Scalar

AT_MARKER: Frame = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
"""The marker frame itself, as a grasp frame."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class GraspPrediction:
    """A grasp frame at a time, with the uncertainty of the prediction.

    time (), s; position (3,), m, in I; quaternion (4,), G to I; twist (6,), [linear; angular], in I; covariance
    (12, 12) of the errors of position in I, attitude as a rotation vector in G, and twist.
    """

    time: Array
    position: Array
    quaternion: Array
    twist: Array
    covariance: Array


@dataclass(frozen=True)
class ConvergenceTolerances:
    """How large the errors of a prediction may be, m, rad, m/s and rad/s, and with what probability each must be met.

    The defaults are those of the capture.
    """

    position: float = 0.01
    attitude: float = float(np.deg2rad(2.0))
    linear_velocity: float = 0.01
    angular_velocity: float = 0.01
    confidence: float = 0.99

    def __post_init__(self):
        for what in ("position", "attitude", "linear_velocity", "angular_velocity"):
            if not getattr(self, what) > 0:
                raise InputError(
                    f"convergence: {what} is {getattr(self, what):g}; a positive number is expected"
                )
        if not 0 < self.confidence < 1:
            raise InputError(f"convergence: confidence is {self.confidence:g}; a share in (0, 1) is expected")

    @property
    def sizes(self) -> np.ndarray:
        """The four tolerances (4,)."""
        return np.array([self.position, self.attitude, self.linear_velocity, self.angular_velocity])


def predict_grasp(
    estimate: TargetEstimate,
    horizon: Scalar,
    grasp_in_marker: Frame = AT_MARKER,
    process_noise: ProcessNoise | None = None,
    num_steps: int | None = None,
) -> GraspPrediction:
    """The grasp frame `horizon` s after the estimate, from its pose in the marker's frame (`Target.grasp_in_marker`).

    Without process noise the target is free meanwhile, and the covariance only follows its motion.

    num_steps, of a quarter of a radian each at most, is found where the numbers are known; where they are traced or the
    estimate is a batch under vmap it must be given.
    """
    if num_steps is None:
        inertia = inertia_from_parameters(estimate.inertia_parameters)
        num_steps = steps_needed(inertia, estimate.angular_velocity_T, horizon)
    added = (process_noise or ProcessNoise()).covariance(horizon / num_steps)

    def step(now, _):
        return predict_step(now, horizon / num_steps, added, ORDER), None

    later, _ = jax.lax.scan(step, estimate, length=num_steps)
    position_M, quaternion_M = jnp.asarray(grasp_in_marker[0]), jnp.asarray(grasp_in_marker[1])

    def grasp(now: TargetEstimate) -> tuple[Array, Array, Array]:
        return fixed_frame(now.state, now.marker_offset_T + position_M, quaternion_M)

    position, quaternion, twist = grasp(later)

    def moved_by(error: Array) -> Array:
        new_position, new_quaternion, new_twist = grasp(corrected(later, error))
        turn = quaternion_multiply(quaternion_conjugate(quaternion), new_quaternion)
        return jnp.concatenate([new_position, quaternion_to_rotation_vector(turn), new_twist])

    by_error = jax.jacfwd(moved_by)(jnp.zeros(NUM_ERRORS))
    return GraspPrediction(later.time, position, quaternion, twist, by_error @ later.covariance @ by_error.T)


def prediction_error(prediction: GraspPrediction, position: Array, quaternion: Array, twist: Array) -> Array:
    """What takes a prediction to the true frame (12,), in the order of its covariance."""
    turn = quaternion_multiply(quaternion_conjugate(prediction.quaternion), quaternion)
    return jnp.concatenate(
        [position - prediction.position, quaternion_to_rotation_vector(turn), twist - prediction.twist]
    )


def has_converged(prediction: GraspPrediction, tolerances: ConvergenceTolerances | None = None) -> Array:
    """Whether the covariance alone says that the prediction is good enough; shape ().

    In each of position, attitude, linear and angular velocity the ellipsoid that holds the error with the probability
    asked for lies within the tolerance.
    """
    tolerances = tolerances or ConvergenceTolerances()
    blocks = jnp.stack([prediction.covariance[k : k + 3, k : k + 3] for k in range(0, 12, 3)])
    # Largest eigenvalue of each block; the trace's share would forgive one bad direction.
    largest = jnp.linalg.eigvalsh(blocks)[:, -1]
    return jnp.all(largest * chi2.ppf(tolerances.confidence, 3) <= tolerances.sizes**2)


def convergence(
    estimates: TargetEstimate,
    horizon: Scalar,
    num_steps: int,
    grasp_in_marker: Frame = AT_MARKER,
    process_noise: ProcessNoise | None = None,
    tolerances: ConvergenceTolerances | None = None,
) -> tuple[Array, GraspPrediction]:
    """Whether each of the estimates (M, ...) predicts the grasp frame `horizon` s on well enough (M,), and the
    predictions (M, ...)."""

    def one(estimate: TargetEstimate) -> tuple[Array, GraspPrediction]:
        prediction = predict_grasp(estimate, horizon, grasp_in_marker, process_noise, num_steps)
        return has_converged(prediction, tolerances), prediction

    return jax.vmap(one)(estimates)
