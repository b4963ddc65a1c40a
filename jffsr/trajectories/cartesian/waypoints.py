"""Straight parts between waypoints with rounded corners.

Along the polygon, of combined length sigma, the way done of part i is the difference of two rounded ramps,
r_i = R_i - R_(i+1), R_i = l_i H((sigma - sigma_i)/l_i), where H(x) is 0 below -1, x above 1 and between them the
integral of the smooth step 1/2 + 3 x/4 - x^3/4. So each corner turns the velocity smoothly from one part's to the
next, over l_i before and behind it, and what is left of the parts is straight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.trajectories.cartesian.cumulative import combined_lengths, partial_pose
from jffsr.trajectories.cartesian.poses import GivenPose, checked_poses, checked_positive
from jffsr.types import Array, Quaternion, Scalar, Vector, Vector3

_ACTIVE = 3  # parts that may be under way at once: one, and one that a corner on either side rounds off
_SAME = 1e-9


@register_dataclass
@dataclass(frozen=True, eq=False)
class Waypoints:
    """Poses joined by straight parts, each with a turn about one axis, and corners rounded off; C2 in s.

    positions (k, 3), m, quaternions (k, 4), unit, in I. metres_per_radian scalar: the length of a part is
    sqrt(distance^2 + (metres_per_radian angle)^2), and s is the share of the sum of lengths. A corner between parts of
    lengths a and b is rounded within l = min(blend_radius, blend_share min(a, b)/2) before and behind it: blend_share
    scalar above 0 and at most 1, blend_radius scalar, m, may be infinite. The path passes beside the corner's position
    at a distance of at most 3/16 l |u_b - u_a|, u = move/length being the two parts' velocities (exactly that where
    |u_a| = |u_b|), and its attitude there is within 3/16 l (|w_a| + |w_b|), w = turn/length. The parts' ends are met
    at the first and last pose alone; along the straight parts |dpose/ds| is the whole length, in corners it is less.
    """

    positions: Array
    quaternions: Array
    blend_share: Array
    blend_radius: Array
    metres_per_radian: Array

    @classmethod
    def through(
        cls,
        poses: Sequence[GivenPose],
        order: str | None = None,
        blend_share: float = 0.5,
        blend_radius: float = np.inf,
        metres_per_radian: float = 1.0,
    ) -> Waypoints:
        """A checked path from host numbers: at least two poses with quaternions, or angles, rad, in `order`.

        Raises InputError for a wrong pose, neighbours that are the same, a share or radius outside its range.
        """
        positions, quaternions = checked_poses(poses, order, 2, "waypoint")
        if not 0 < blend_share <= 1:
            raise InputError(f"blend_share is {blend_share:g}; it must be above 0 and at most 1")
        if not blend_radius > 0:
            raise InputError(f"blend_radius is {blend_radius:g} m; it must be positive")
        weight = checked_positive(metres_per_radian, "metres_per_radian", "m")
        refuse_repeated(np.asarray(combined_lengths(positions, quaternions, weight)), "waypoint")
        return cls(
            positions, quaternions, np.array(float(blend_share)), np.array(float(blend_radius)), weight
        )

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]:
        """Position (3,), m, and attitude (4,) at s in [0, 1]."""
        lengths = combined_lengths(self.positions, self.quaternions, self.metres_per_radian)
        ends = jnp.cumsum(lengths)
        place = s * ends[-1]
        corners = ends[:-1]
        reach = jnp.minimum(self.blend_radius, self.blend_share * jnp.minimum(lengths[:-1], lengths[1:]) / 2)
        ramps = reach * _rounded_ramp((place - corners) / reach)
        ramps = jnp.concatenate([place[None], ramps, jnp.zeros_like(place)[None]])
        parts = (ramps[:-1] - ramps[1:]) / lengths
        count = min(_ACTIVE, lengths.shape[0])
        part = jnp.sum(place >= corners)
        first = jnp.clip(part - 1, 0, lengths.shape[0] - count)
        return partial_pose(jnp.asarray(self.positions), jnp.asarray(self.quaternions), parts, first, count)


def refuse_repeated(lengths: np.ndarray, what: str) -> None:
    """InputError if a step between neighbours has no length."""
    for i, length in enumerate(lengths):
        if length < _SAME:
            raise InputError(f"{what}s {i} and {i + 1} are the same pose; neighbours must differ")


def _rounded_ramp(x: Vector) -> Vector:
    """0 below -1, x above 1, and between them what joins these with two continuous derivatives; 3/16 at zero."""
    inside = jnp.clip(x, -1.0, 1.0)
    between = 3 / 16 + inside / 2 + 3 * inside**2 / 8 - inside**4 / 16
    return jnp.where(x < -1, 0.0, jnp.where(x > 1, x, between))
