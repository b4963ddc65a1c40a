"""Multiplicative extended Kalman filter of a tumbling target, from poses of a frame fixed to it.

After F. Aghili and K. Parsa, "Motion and parameter estimation of space objects using laser-vision data" (2009):
attitude, rate, inertia ratios, position, velocity, and offset of the marker. The attitude's error is a rotation vector
(Lefferts, Markley and Shuster, 1982). The axes are the marker's, so that the attitude between them and the principal
axes, which Aghili estimates beside two ratios, is in the five numbers of the inertia.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import chi2

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.target.acquisition import acquire
from jffsr.target.camera import Camera, Measurements
from jffsr.target.estimate import TargetEstimate
from jffsr.target.filter_steps import ProcessNoise, predict_step, update_step
from jffsr.target.prior import TargetPrior
from jffsr.target.refitting import refit
from jffsr.types import Array

# Order of the Taylor series over one sample interval: a turn of 0.1 rad leaves 1e-11.
_ORDER = 8


@dataclass(frozen=True)
class FilterSettings:
    """How a target is filtered.

    acquisition: how many of the first poses are fitted together; gate_probability: share of good poses that the gate
    lets pass, by the chi-square distribution of the normalised squared innovation; process_noise, what disturbs the
    target; refit_every: after how many poses all poses so far are fitted together anew, as those of a free target, so
    never where there is process noise; lost_after: how many poses refused in a row mean that the track is lost.
    Raises InputError for numbers that make no sense.
    """

    acquisition: int = 100
    gate_probability: float = 0.999
    process_noise: ProcessNoise = field(default_factory=ProcessNoise)
    refit_every: int = 25
    lost_after: int = 10

    def __post_init__(self):
        for what in ("acquisition", "refit_every", "lost_after"):
            if not getattr(self, what) >= 1:
                raise InputError(f"target filter: {what} is {getattr(self, what)}; 1 or more is expected")
        if not 0 < self.gate_probability < 1:
            raise InputError(
                f"target filter: gate_probability is {self.gate_probability:g}; a share in (0, 1) is expected"
            )

    @property
    def gate(self) -> float:
        """Largest normalised squared innovation of a pose that is used."""
        return float(chi2.ppf(self.gate_probability, 6))


@register_dataclass
@dataclass(frozen=True, eq=False)
class FilteredTarget:
    """A filter's course over the M samples that follow the acquisition.

    estimate (M, ...) after the pose of each exposure; innovation (M, 6), [m in I; rad in T], measured less expected;
    normalised_innovation_squared (M,); used (M,), whether the pose corrected the estimate; refused_in_a_row (M,), how
    many poses the gate has refused since the last good one; lost (M,), whether these are too many.
    """

    estimate: TargetEstimate
    innovation: Array
    normalised_innovation_squared: Array
    used: Array
    refused_in_a_row: Array
    lost: Array


def filter_target(
    measurements: Measurements,
    camera: Camera,
    prior: TargetPrior,
    settings: FilterSettings | None = None,
) -> FilteredTarget:
    """The estimates of a target from the poses (N, ...) of its marker in I; vmap for many, jit for speed.

    Each estimate is at a pose's exposure; it is to hand the camera's delay later, and `predict_grasp` takes it on
    to any time. Raises InputError for fewer poses than the acquisition takes.
    """
    settings = settings or FilterSettings()
    count, window = measurements.time.shape[0], settings.acquisition
    if count <= window:
        raise InputError(
            f"target filter: {count} poses were measured, and the acquisition alone takes {window} of them"
        )
    noise = jnp.asarray(camera.covariance)
    interval = 1 / camera.rate
    early = jax.tree.map(lambda x: x[:window], measurements)
    start, trusted = acquire(early, interval, prior, noise, settings.gate, _ORDER)
    added = settings.process_noise.covariance(interval)

    def step(carry, measured):
        estimate, refused = carry
        estimate, residual, squared, used = update_step(
            estimate, measured.position, measured.quaternion, measured.seen, noise, settings.gate
        )
        refused = jnp.where(used, 0, refused + measured.seen)
        following = predict_step(estimate, interval, added, _ORDER)
        return (following, refused), (estimate, residual, squared, used, refused)

    # Unseen poses fill the last stretch.
    free = settings.process_noise == ProcessNoise()
    length = settings.refit_every if free else count - window
    num_stretches = -(-(count - window) // length)
    total = window + num_stretches * length
    poses = jax.tree.map(
        lambda x: jnp.concatenate([x, jnp.repeat(x[-1:], total - count, axis=0)]), measurements
    )
    poses = replace(poses, seen=poses.seen.at[count:].set(False))
    trusted = jnp.zeros(total, bool).at[:window].set(trusted)

    def stretch(carry, place):
        start, trusted, refused = carry
        start, estimate = refit(start, poses, place, trusted, interval, prior, noise, _ORDER)
        piece = jax.tree.map(lambda x: jax.lax.dynamic_slice_in_dim(x, place, length), poses)
        (_, refused), course = jax.lax.scan(step, (estimate, refused), piece)
        trusted = jax.lax.dynamic_update_slice_in_dim(trusted, course[3], place, 0)
        return (start, trusted, refused), course

    places = window + length * jnp.arange(num_stretches)
    _, course = jax.lax.scan(stretch, (start, trusted, jnp.zeros((), int)), places)
    course = jax.tree.map(lambda x: x.reshape(-1, *x.shape[2:])[: count - window], course)
    return FilteredTarget(*course, lost=course[-1] >= settings.lost_after)


def expected_innovation_squared(settings: FilterSettings) -> float:
    """Mean of the normalised squared innovation of good poses that the gate lets pass; 6 without a gate."""
    return float(6 * chi2.cdf(settings.gate, 8) / chi2.cdf(settings.gate, 6))


def chi_square_bounds(freedom: int, runs: int, probability: float = 0.95) -> tuple[float, float]:
    """Bounds that the mean over independent runs of a normalised square of so many numbers keeps with a probability."""
    tails = np.array([(1 - probability) / 2, (1 + probability) / 2])
    return tuple(chi2.ppf(tails, freedom * runs) / runs)
