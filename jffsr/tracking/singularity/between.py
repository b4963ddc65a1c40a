"""A motion between its samples, and how its zeros and minima are found there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from jffsr.errors import InputError
from jffsr.robots.robot import Robot

_POINTS = 64
_FINEST = 1e-9  # s, at which a bracket is narrow enough
_ROUNDS = 20  # and after so many it is as narrow as the times' last digits allow


@dataclass(frozen=True)
class Postures:
    """A motion as samples: time (k,), s, increasing; joint_position (k, n).

    joint_velocity (k, n), base_position (k, 3), m, and base_quaternion (k, 4), B to I, where they are known; without
    them the joints move straight from sample to sample, and the base stands at the origin with the axes of I.
    """

    time: np.ndarray
    joint_position: np.ndarray
    joint_velocity: np.ndarray | None = None
    base_position: np.ndarray | None = None
    base_quaternion: np.ndarray | None = None


def postures_of(motion) -> Postures:
    """What is needed of a Motion, of a result that carries one as `motion`, or of Postures, as host arrays.

    Raises InputError for what is none of them.
    """
    motion = getattr(motion, "motion", motion)
    if not hasattr(motion, "time") or not hasattr(motion, "joint_position"):
        raise InputError(f"a motion has time and joint_position; found {type(motion).__name__}")
    names = ("time", "joint_position", "joint_velocity", "base_position", "base_quaternion")
    values = {name: getattr(motion, name, None) for name in names}
    return Postures(**{k: None if v is None else np.asarray(v, dtype=float) for k, v in values.items()})


class Between:
    """The posture of a motion at any times (p,) on its own interval.

    The joints follow the cubic that has their positions and rates at both samples, or straight lines where that
    is what the rates say (rates held over each sample) or no rates are known. The base position is linear between
    samples; the attitude turns at a constant rate.
    """

    def __init__(self, robot: Robot, motion: object):
        postures = postures_of(motion)
        _check(robot, postures)
        self.time, joints, rates = postures.time, postures.joint_position, postures.joint_velocity
        count = len(self.time)
        position, quaternion = postures.base_position, postures.base_quaternion
        self._base_position = np.zeros((count, 3)) if position is None else position
        turns = (
            Rotation.identity(count)
            if quaternion is None
            else Rotation.from_quat(quaternion, scalar_first=True)
        )
        self._attitude = (
            Slerp(self.time, turns) if count > 1 else lambda times: turns[np.zeros(len(times), dtype=int)]
        )
        self._joints = _straight(self.time, joints)
        if count > 1 and rates is not None:
            steps = np.diff(self.time)[:, None]
            held = np.allclose(np.diff(joints, axis=0), steps * rates[:-1], rtol=1e-9, atol=1e-12)
            if not held:
                self._joints = CubicHermiteSpline(self.time, joints, rates)

    def joints(self, times: np.ndarray) -> np.ndarray:
        """Joint positions (p, n)."""
        return self._joints(np.asarray(times))

    def base(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Base positions (p, 3), m, and quaternions (p, 4)."""
        quaternion = self._attitude(np.asarray(times)).as_quat(scalar_first=True)
        return _straight(self.time, self._base_position)(np.asarray(times)), quaternion

    def finer(self, parts: int) -> np.ndarray:
        """The samples' times with each interval cut into `parts`."""
        starts, steps = self.time[:-1, None], np.diff(self.time)[:, None]
        return np.append(starts + steps * np.arange(parts) / parts, self.time[-1])


def _straight(time: np.ndarray, values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    return lambda times: np.stack([np.interp(times, time, column) for column in values.T], axis=-1)


def _check(robot: Robot, postures: Postures) -> None:
    time, count = postures.time, len(np.atleast_1d(postures.time))
    if time.ndim != 1 or count == 0 or not np.all(np.diff(time) > 0):
        raise InputError("time must be a list of increasing times with at least one of them")
    shapes = {
        "joint_position": (count, robot.num_joints),
        "joint_velocity": (count, robot.num_joints),
        "base_position": (count, 3),
        "base_quaternion": (count, 4),
    }
    for name, shape in shapes.items():
        value = getattr(postures, name)
        if value is not None and value.shape != shape:
            raise InputError(
                f"{name} has shape {value.shape}; {count} samples of '{robot.name}' need {shape}"
            )
        if value is not None and not np.all(np.isfinite(value)):
            raise InputError(f"{name} is not finite at time {time[~np.isfinite(value).all(axis=1)][0]:g} s")
    quaternion = postures.base_quaternion
    if quaternion is not None and np.any(np.abs(np.linalg.norm(quaternion, axis=1) - 1) > 1e-6):
        raise InputError("base_quaternion must hold unit quaternions (w, x, y, z)")


def find_zero(function: Callable[[np.ndarray], np.ndarray], low: float, high: float) -> float:
    """Where a function of times (p,) changes sign between two times at which its signs differ."""
    for _ in range(_ROUNDS):
        if high - low <= _FINEST:
            break
        times = np.linspace(low, high, _POINTS)
        negative = np.signbit(function(times))
        place = int(np.argmax(negative != negative[0]))
        if place == 0:
            break
        low, high = times[place - 1], times[place]
    return float(0.5 * (low + high))


def find_minimum(function: Callable[[np.ndarray], np.ndarray], low: float, high: float) -> float:
    """Where a function of times (p,) with one minimum between two times, or at one of them, has it.

    The function may have a corner there.
    """
    ends = low, high
    for _ in range(_ROUNDS):
        if high - low <= _FINEST:
            break
        times = np.linspace(low, high, _POINTS)
        place = int(np.argmin(function(times)))
        low, high = times[max(place - 1, 0)], times[min(place + 1, _POINTS - 1)]
    candidates = np.array([*ends, 0.5 * (low + high)])
    return float(candidates[np.argmin(function(candidates))])
