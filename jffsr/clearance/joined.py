"""Pairs of bodies that always touch, because they are joined by more than the tree says."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jffsr.clearance.along_motion import clearances
from jffsr.robots.robot import Robot

if TYPE_CHECKING:
    from jffsr.clearance.model import ClearanceModel

# Random postures that find what is joined; the range, m, of a sliding joint that has no limits; and out of reach.
_POSTURES, _SLIDE, _FAR = 256, 1.0, 1e4


def always_touching(model: ClearanceModel, robot: Robot) -> np.ndarray:
    """Which pairs (p,) of the model touch in every one of many random postures, with the target out of reach."""
    generator = np.random.default_rng(0)
    limits, turning = robot.limits, robot.topology.is_revolute
    lower, upper = np.array(limits.position_lower, float), np.array(limits.position_upper, float)
    widest = np.where(turning, np.pi, _SLIDE)
    lower, upper = np.where(np.isfinite(lower), lower, -widest), np.where(np.isfinite(upper), upper, widest)
    postures = generator.uniform(lower, upper, (_POSTURES, robot.num_joints))
    at_origin = np.zeros((_POSTURES, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (_POSTURES, 1))
    target = _Poses(at_origin[0] + _FAR, at_origin[1]) if model.has_target else None
    return np.all(clearances(model, robot, _Postures(*at_origin, postures), target) <= 0, axis=1)


class _Postures(NamedTuple):
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray


class _Poses(NamedTuple):
    position: np.ndarray
    quaternion: np.ndarray
