"""Circles and arcs, about an axis or through three points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint, listed
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.spatial.safe import safe_norm
from jffsr.trajectories.cartesian.poses import (
    GivenPose,
    checked_attitude,
    checked_pose,
    checked_vector,
    shortest_turn,
)
from jffsr.types import Array, Quaternion, Scalar, Vector3

ATTITUDES = ("fixed", "turning", "to_goal")
_FLAT = 1e-9  # rad: below, three points count as on one line


@register_dataclass
@dataclass(frozen=True, eq=False)
class Arc:
    """The start's position carried about an axis by an angle; the attitude turning by a rotation vector meanwhile.

    centre (3,), m, any point of the axis; axis (3,), of any length but zero; angle scalar, rad, of any size and sign;
    start_position (3,), m; start_quaternion (4,), unit; turn (3,), rad, the whole turn of the attitude, zero for a
    fixed one; all in I. s is the share of angle and turn.
    """

    centre: Array
    axis: Array
    angle: Array
    start_position: Array
    start_quaternion: Array
    turn: Array

    @classmethod
    def about(
        cls,
        centre: Sequence[float],
        axis: Sequence[float],
        start: GivenPose,
        angle: float = 2 * np.pi,
        attitude: str = "fixed",
        goal_attitude: Sequence[float] | None = None,
        order: str | None = None,
    ) -> Arc:
        """A checked arc from host numbers: about the axis through the centre from a start pose, by an angle, rad.

        attitude: `fixed`; `turning` with the arc; or `to_goal`, the shortest way to goal_attitude. Raises InputError
        for a start on the axis, an axis or angle that is zero, a wrong pose or an unknown attitude.
        """
        centre, axis = checked_vector(centre, 3, "centre"), checked_vector(axis, 3, "axis")
        position, q = checked_pose(start, order, "start")
        if not np.linalg.norm(axis) > 0:
            raise InputError("axis is zero; it must have a direction")
        if not (np.isfinite(angle) and angle != 0):
            raise InputError(f"angle is {angle:g} rad; it must be finite and not zero")
        axis = axis / np.linalg.norm(axis)
        away = position - centre
        if np.linalg.norm(np.cross(axis, away)) <= _FLAT * (1 + np.linalg.norm(away)):
            raise InputError(f"start position {position.tolist()} lies on the axis; an arc needs a radius")
        turn = _whole_turn(attitude, axis * angle, q, goal_attitude, order)
        return cls(centre, axis, np.array(angle, dtype=float), position, q, turn)

    @classmethod
    def through(
        cls,
        start: GivenPose,
        via: Sequence[float],
        goal: GivenPose,
        attitude: str = "to_goal",
        order: str | None = None,
    ) -> Arc:
        """A checked arc from host numbers: from start to goal, poses, through the position `via`, m, between them.

        The goal's attitude is met with attitude `to_goal` alone. Raises InputError for three points on one line.
        """
        via = checked_vector(via, 3, "via")
        (first, q), (last, goal_q) = checked_pose(start, order, "start"), checked_pose(goal, order, "goal")
        a, b = via - first, last - first
        normal = np.cross(a, b)
        size = np.linalg.norm(normal)
        if size <= _FLAT * np.linalg.norm(a) * np.linalg.norm(b):
            raise InputError("start, via and goal lie on one line; three other points or a Line are expected")
        # The circumcentre, from first.
        middle = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * size**2)
        axis = normal / size
        angle = np.arctan2(axis @ np.cross(-middle, b - middle), -middle @ (b - middle)) % (2 * np.pi)
        turn = _whole_turn(attitude, axis * angle, q, goal_q if attitude == "to_goal" else None, None)
        return cls(first + middle, axis, np.array(angle), first, q, turn)

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]:
        """Position (3,), m, and attitude (4,) at s in [0, 1]."""
        axis = self.axis / safe_norm(jnp.asarray(self.axis))
        away = self.start_position - self.centre
        along = jnp.dot(axis, away) * axis
        outward, sideways, angle = away - along, jnp.cross(axis, away), s * self.angle
        position = self.centre + along + jnp.cos(angle) * outward + jnp.sin(angle) * sideways
        turned = rotation_vector_to_quaternion(s * jnp.asarray(self.turn))
        return position, quaternion_multiply(turned, jnp.asarray(self.start_quaternion))


def _whole_turn(
    attitude: str, with_arc: np.ndarray, q: np.ndarray, goal: Sequence[float] | None, order: str | None
) -> np.ndarray:
    """Rotation vector (3,), rad, of the attitude over the whole arc."""
    if attitude not in ATTITUDES:
        allowed = f"{listed([repr(x) for x in ATTITUDES])} is expected"
        raise InputError(f"attitude {attitude!r} is unknown: {allowed}{hint(str(attitude), ATTITUDES)}")
    if (goal is None) == (attitude == "to_goal"):
        raise InputError("goal_attitude goes with attitude 'to_goal' and with no other")
    if attitude == "to_goal":
        return np.asarray(shortest_turn(q, checked_attitude(goal, order, "goal attitude")))
    return with_arc if attitude == "turning" else np.zeros(3)
