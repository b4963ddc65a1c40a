"""Which of the tool's six directions count, in which frame, and how metres and radians are made one unit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint, listed
from jffsr.robots.robot import Robot

DIRECTIONS = ("x", "y", "z", "about_x", "about_y", "about_z")
"""The directions of a twist, [linear; angular]."""
INERTIAL, TOOL = "inertial", "tool"
FRAMES = (INERTIAL, TOOL)
NEAR_SHARE = 1 / 30
"""Near-singular by default: a singular value below this share of the largest one's median over what is looked at."""


@dataclass(frozen=True)
class ToolTask:
    """Some of the tool's directions, resolved in I or in E, with the length, m, that one radian counts as.

    A singular value of the task's Jacobian is then in m (of tool motion per radian of joint motion); a sliding
    joint's travel counts as a turn by travel/length_scale. Static: nothing of it is traced.
    """

    directions: tuple[str, ...] = DIRECTIONS
    frame: str = INERTIAL
    length_scale: float = 1.0

    @property
    def rows(self) -> np.ndarray:
        """Their places in a twist, (k,)."""
        return np.array([DIRECTIONS.index(name) for name in self.directions])

    @property
    def row_scale(self) -> np.ndarray:
        """What the rows of a Jacobian are multiplied by, (k,): 1 for lengths, the length scale for turns."""
        return np.where(self.rows < 3, 1.0, self.length_scale)


def make_task(directions: str | Sequence[str] | None, frame: str, length_scale: float) -> ToolTask:
    """A task from its names; None means all six directions. InputError for what names none."""
    if frame not in FRAMES:
        raise InputError(f"frame is {frame!r}; allowed are {listed(FRAMES)}{hint(str(frame), FRAMES)}")
    if not 0 < length_scale < math.inf:
        raise InputError(f"length_scale is {length_scale}; it must be positive and finite")
    names = DIRECTIONS if directions is None else (directions,) if isinstance(directions, str) else directions
    for name in names:
        if name not in DIRECTIONS:
            raise InputError(
                f"direction {name!r} is unknown; allowed are {listed(DIRECTIONS)}{hint(str(name), DIRECTIONS)}"
            )
    if not names or len(set(names)) < len(names):
        raise InputError(f"directions are {list(names)}; name each wanted one once")
    return ToolTask(tuple(names), frame, float(length_scale))


def joint_scale(robot: Robot, task: ToolTask) -> np.ndarray:
    """Joint motion (n,), rad or m, that counts as one radian."""
    return np.where(robot.topology.is_revolute, 1.0, task.length_scale)
