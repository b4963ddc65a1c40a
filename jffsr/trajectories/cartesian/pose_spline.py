"""Clamped splines of poses, drawn by control poses or through given ones.

With a basis N_j, sum_j N_j = 1, the position is sum_j N_j p_j, and the attitude is q_0 prod_i exp(b_i w_i) with
b_i = sum over j >= i of N_j and w_i = log(q_(i-1)* q_i): Kim, Kim and Shin, "A general construction scheme for unit
quaternion curves with simple high order derivatives", 1995, eq. (4). The basis is that of the clamped B-spline, for
control poses, or its combination C = N M^-1, M_kj = N_j(s_k), whose functions are 1 at their own place and 0 at the
others: then the position is the interpolating spline, every b_i is 0 or 1 at the places, and the attitudes there are
the given ones. Either is C^(degree - 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.trajectories.bspline import basis
from jffsr.trajectories.cartesian.cumulative import combined_lengths, partial_pose
from jffsr.trajectories.cartesian.poses import GivenPose, checked_poses, checked_positive
from jffsr.trajectories.cartesian.waypoints import refuse_repeated
from jffsr.trajectories.checks import checked_size
from jffsr.types import Array, Quaternion, Scalar, Vector3

_LEAST_DEGREE = 3  # below, the acceleration jumps on the way


@register_dataclass
@dataclass(frozen=True, eq=False)
class PoseSpline:
    """A smooth path from the first of some poses to the last, drawn towards those between or through them.

    positions (k, 3), m, and quaternions (k, 4), unit, in I, neighbours joined by the shortest turn; knots
    (k + degree + 1,) in [0, 1], the first and last degree + 1 of them 0 and 1; interpolation (k, k), the matrix M^-1
    of a spline through the poses, or None for one of control poses; degree static, at least 3, so that the path is C2.
    """

    positions: Array
    quaternions: Array
    knots: Array
    interpolation: Array | None = None
    degree: int = field(default=3, metadata={"static": True})

    @classmethod
    def by_control(cls, poses: Sequence[GivenPose], degree: int = 3, order: str | None = None) -> PoseSpline:
        """A checked spline from host numbers: control poses with quaternions or angles, rad, in `order`.

        The knots are uniform. Raises InputError for a wrong pose, a degree below 3 or fewer than degree + 1 poses.
        """
        degree = checked_size(degree, _LEAST_DEGREE, "degree")
        positions, quaternions = checked_poses(poses, order, degree + 1, "control pose")
        inside = np.linspace(0, 1, len(poses) - degree + 1)
        knots = np.concatenate([np.zeros(degree), inside, np.ones(degree)])
        return cls(positions, quaternions, knots, None, degree)

    @classmethod
    def through(
        cls,
        poses: Sequence[GivenPose],
        degree: int = 3,
        order: str | None = None,
        metres_per_radian: float = 1.0,
    ) -> PoseSpline:
        """A checked spline from host numbers that passes through all the poses; see `spline_through`.

        Raises InputError for a wrong pose, neighbours that are the same, a degree below 3 or fewer than degree + 1
        poses.
        """
        degree = checked_size(degree, _LEAST_DEGREE, "degree")
        positions, quaternions = checked_poses(poses, order, degree + 1, "pose")
        weight = checked_positive(metres_per_radian, "metres_per_radian", "m")
        refuse_repeated(np.asarray(combined_lengths(positions, quaternions, weight)), "pose")
        return jax.tree.map(np.asarray, spline_through(positions, quaternions, weight, degree))

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]:
        """Position (3,), m, and attitude (4,) at s in [0, 1]."""
        positions, quaternions = jnp.asarray(self.positions), jnp.asarray(self.quaternions)
        functions = basis(self.knots, self.degree, jnp.asarray(s))[-1]
        if self.interpolation is not None:
            functions = functions @ self.interpolation
        parts = jnp.cumsum(functions[::-1])[::-1][1:]
        if self.interpolation is not None:
            return partial_pose(positions, quaternions, parts, 0, parts.shape[0])
        # A B-spline depends on the control poses about one span only.
        first = jnp.sum(s >= self.knots[self.degree + 1 : -self.degree - 1])
        return partial_pose(positions, quaternions, parts, first, self.degree)


@jax.jit(static_argnames="degree")
def spline_through(
    positions: Array, quaternions: Array, metres_per_radian: Array, degree: int = 3
) -> PoseSpline:
    """The spline through poses (k, 3), m, and (k, 4), differentiable by them.

    s at a pose is its share of the sum of combined lengths, m, of the steps between poses, a radian counting as
    `metres_per_radian`; the knots between are running means of these (de Boor).
    """
    lengths = combined_lengths(positions, quaternions, metres_per_radian)
    places = jnp.concatenate([jnp.zeros(1), jnp.cumsum(lengths) / jnp.sum(lengths)])
    means = [jnp.mean(places[j : j + degree]) for j in range(1, lengths.shape[0] - degree + 1)]
    knots = jnp.concatenate([jnp.zeros(degree + 1), jnp.array(means, places.dtype), jnp.ones(degree + 1)])
    matrix = basis(knots, degree, places)[-1].T
    return PoseSpline(positions, quaternions, knots, jnp.linalg.inv(matrix), degree)
