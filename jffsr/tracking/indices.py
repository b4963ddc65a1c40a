"""How well a tool kept to its path, in one number: the published index, true errors, rate penalties, smooth forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.spatial.safe import peak, safe_norm, safe_sqrt, smooth_hinge, smooth_max, smooth_norm
from jffsr.tracking.tracked import Tracked
from jffsr.types import Array, Scalar

# What smooth forms round off at looseness 1, relative to the scale of what they measure.
_ROUNDING = 1e-3


def published_error(tracked: Tracked) -> Array:
    """B at every sample (K + 1,): 0.5 |dp| + 0.5 |dphi|, dphi being the componentwise product of position and attitude
    error.

    Wu et al. 2018, eqs. 17 and 18, with the attitude error's rotation vector in I. The product hardly sees attitude:
    `pose_errors` does.
    """
    offset, turn = tracked.pose_error[:, :3], tracked.pose_error[:, 3:]
    return 0.5 * safe_norm(offset) + 0.5 * safe_norm(offset * turn)


def published_index(tracked: Tracked) -> Scalar:
    """The published B without its limit on rates: that of the path's end, which is the one that is printed."""
    return published_error(tracked)[-1]


class PoseErrors(NamedTuple):
    """Tool pose less its target over the whole path: m and rad; peaks, root mean squares and at the end."""

    position_peak: Scalar
    position_rms: Scalar
    position_end: Scalar
    attitude_peak: Scalar
    attitude_rms: Scalar
    attitude_end: Scalar


def pose_errors(tracked: Tracked) -> PoseErrors:
    """Position error, m, and attitude error, the angle in rad, over the samples of the path."""
    found = []
    for part in (tracked.pose_error[:, :3], tracked.pose_error[:, 3:]):
        size = safe_norm(part)
        found += [peak(size), safe_sqrt(jnp.mean(jnp.sum(part**2, axis=-1))), size[-1]]
    return PoseErrors(*found)


def peak_rate(tracked: Tracked) -> Scalar:
    """Largest joint rate of the motion, rad/s or m/s, over joints and samples."""
    return peak(jnp.abs(tracked.motion.joint_velocity).ravel())


def rate_overrun(tracked: Tracked, limit: Array | float) -> Scalar:
    """By how much the peaks of the rates exceed the limit, () or (n,), relative to it, summed over the joints."""
    peaks = peak(jnp.abs(tracked.motion.joint_velocity))
    return jnp.sum(jnp.maximum(peaks / limit - 1, 0.0))


@register_dataclass
@dataclass(frozen=True)
class PublishedIndex:
    """B at the end of the path plus `weight` times the relative overrun of a rate limit, rad/s.

    Wu et al. 2018, eq. 17.

    The printed penalty of eq. 19 is infinite, with which nothing outside the limit can be told apart; a large weight
    does the same and lets a search find its way.
    """

    rate_limit: Array | float
    weight: Array | float = 1.0

    def value(self, tracked: Tracked) -> Scalar:
        """B, and the weighted overrun."""
        return published_index(tracked) + self.weight * rate_overrun(tracked, self.rate_limit)

    def smooth(self, tracked: Tracked, looseness: Scalar | float = 1.0) -> Scalar:
        """The same rounded off, differentiable at zero error and at a limit just met."""
        offset, turn = tracked.pose_error[-1, :3], tracked.pose_error[-1, 3:]
        width = _ROUNDING * _ROUNDING * looseness
        error = 0.5 * smooth_norm(offset, width) + 0.5 * smooth_norm(offset * turn, width)
        return error + self.weight * _smooth_overrun(tracked, self.rate_limit, looseness)


@register_dataclass
@dataclass(frozen=True)
class PathError:
    """Pose error over the whole path, m, with a weight on the overrun of a rate limit.

    The root mean square of sqrt(|dp|^2 + (radius angle)^2), plus peak_weight times its largest, plus weight times
    the relative overrun of rate_limit, rad/s. radius, m, is the lever at which a rotation counts as a displacement.
    """

    rate_limit: Array | float
    weight: Array | float = 1.0
    radius: Array | float = 0.3
    peak_weight: Array | float = 0.0

    def value(self, tracked: Tracked) -> Scalar:
        """The error, m, and the weighted overrun."""
        squared = self._squared(tracked)
        error = safe_sqrt(jnp.mean(squared)) + self.peak_weight * safe_sqrt(peak(squared))
        return error + self.weight * rate_overrun(tracked, self.rate_limit)

    def smooth(self, tracked: Tracked, looseness: Scalar | float = 1.0) -> Scalar:
        """The same rounded off, differentiable at zero error and at a limit just met."""
        squared, width = self._squared(tracked), _ROUNDING * _ROUNDING * looseness
        each = jnp.sqrt(squared + width**2) - width
        error = jnp.sqrt(jnp.mean(squared) + width**2) - width + self.peak_weight * smooth_max(each, width)
        return error + self.weight * _smooth_overrun(tracked, self.rate_limit, looseness)

    def _squared(self, tracked: Tracked) -> Array:
        scale = jnp.concatenate([jnp.ones(3), jnp.full(3, 1.0) * self.radius])
        return jnp.sum((tracked.pose_error * scale) ** 2, axis=-1)


def _smooth_overrun(tracked: Tracked, limit: Array | float, looseness: Scalar | float) -> Scalar:
    width = _ROUNDING * looseness
    relative = jnp.abs(tracked.motion.joint_velocity) / limit
    return jnp.sum(smooth_hinge(smooth_max(relative, width) - 1, width))
