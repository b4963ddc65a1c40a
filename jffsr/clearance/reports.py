"""What a clearance says in words: a start that overlaps, and where a motion comes nearest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Array


@dataclass(frozen=True)
class NearestApproach:
    """The smallest signed distance of a motion: `distance`, m, between the bodies `pair`, at `time`, s.

    sample is its number on the motion's grid.
    """

    pair: tuple[str, str]
    distance: float
    time: float
    sample: int

    def __str__(self) -> str:
        what = "overlap by" if self.distance < 0 else "come within"
        return f"{' and '.join(self.pair)} {what} {abs(self.distance):.4g} m at {self.time:.4g} s"


def nearest_approach(
    model: ClearanceModel, robot: Robot, motion: Any, target_states: Any | None = None
) -> NearestApproach:
    """Which pair of bodies comes nearest in a Motion, how near and when; the arguments are those of `clearances`."""
    distances = np.asarray(clearances(model, robot, motion, target_states))
    pair, sample = np.unravel_index(np.argmin(distances), distances.shape)
    time = float(np.asarray(motion.time)[sample])
    return NearestApproach(model.pair_names[pair], float(distances[pair, sample]), time, int(sample))


def check_start(
    model: ClearanceModel, robot: Robot, state: State, target_state: Any | None = None, margin: float = 0.0
) -> None:
    """InputError where two bodies overlap at the start, or are nearer than `margin`, m, naming the nearest two.

    target_state has position (3,), m, and quaternion (4,), T to I, as a TargetState has.
    """
    poses = (state.base_position, state.base_quaternion, state.joint_position)
    start = _Sample(*(np.asarray(x, float)[None] for x in poses))
    target = None
    if target_state is not None:
        target = _Pose(np.asarray(target_state.position)[None], np.asarray(target_state.quaternion)[None])
    distances = np.asarray(clearances(model, robot, start, target))[:, 0]
    nearest = int(np.argmin(distances))
    first, second = model.pair_names[nearest]
    if distances[nearest] < 0:
        raise InputError(
            f"start in collision: '{first}' and '{second}' overlap by {-distances[nearest]:.4g} m; "
            "move the joints or the target apart, or leave the pair out (ignore)"
        )
    if distances[nearest] < margin:
        raise InputError(
            f"start in collision: '{first}' and '{second}' are {distances[nearest]:.4g} m apart, less than the "
            f"margin of {margin:.4g} m"
        )


class _Sample(NamedTuple):
    base_position: Array
    base_quaternion: Array
    joint_position: Array


class _Pose(NamedTuple):
    position: Array
    quaternion: Array
