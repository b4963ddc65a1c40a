"""A straight line with a turn about one fixed axis: Wu et al. 2018, eqs. (3) and (4)."""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.pytrees import register_dataclass
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.trajectories.cartesian.poses import GivenPose, checked_pose, shortest_turn
from jffsr.types import Array, Quaternion, Scalar, Vector3


@register_dataclass
@dataclass(frozen=True, eq=False)
class Line:
    """Straight from pose to pose, the attitude turning about one axis, fixed in I, by the shortest way.

    start_position and goal_position (3,), m, start_quaternion and goal_quaternion (4,), unit, all in I and all of
    them differentiable; s is the share of the length and of the turn. At 180 degrees one of the two ways is taken
    whatever the quaternions' signs.
    """

    start_position: Array
    start_quaternion: Array
    goal_position: Array
    goal_quaternion: Array

    @classmethod
    def between(cls, start: GivenPose, goal: GivenPose, order: str | None = None) -> Line:
        """A checked line from host numbers: pairs of position, m, and attitude, a quaternion or angles in `order`.

        Raises InputError for numbers that are not finite, a quaternion that is not unit or an unknown order.
        """
        return cls(*checked_pose(start, order, "start"), *checked_pose(goal, order, "goal"))

    def __call__(self, s: Scalar) -> tuple[Vector3, Quaternion]:
        """Position (3,), m, and attitude (4,) at s in [0, 1]."""
        turn = shortest_turn(self.start_quaternion, self.goal_quaternion)
        attitude = quaternion_multiply(rotation_vector_to_quaternion(s * turn), self.start_quaternion)
        return self.start_position + s * (self.goal_position - self.start_position), attitude
