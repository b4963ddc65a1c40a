"""The state of a free-floating robot."""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.pytrees import register_dataclass
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class State:
    """Pose and, where known, velocity of a robot.

    base_position (3,), m, of the base's centre of mass in I; base_quaternion (4,), B to I;
    joint_position (n,), rad or m; base_twist (6,), [linear; angular] in I; joint_velocity (n,). None in
    the last two reads zero.
    """

    base_position: Array
    base_quaternion: Array
    joint_position: Array
    base_twist: Array | None = None
    joint_velocity: Array | None = None
