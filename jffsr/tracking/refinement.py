"""A tracked motion made better by itself: every held rate, and the pace along the path, chosen for the least of the
largest tool error.

A resolved-rate law decides at each instant from what it sees there. Here the whole motion is one problem: with the
derivative of the rollout the error is linear in small changes of all rates, limits of rates, of their changes and of
joint positions are linear, and the least largest error is a linear programme. It is solved again and again within a
region of trust that grows where the prediction was right (sequential linear programming: Fletcher and Sainz de la Maza
1989; Conn, Gould and Toint, Trust-Region Methods, 2000). What it finds is a local optimum.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax.numpy as jnp
import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.tracking.retimed import Retimed
from jffsr.tracking.sensitivity import sensitivity
from jffsr.tracking.tool_task import ALL, FREEDOMS
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracking import track_rates
from jffsr.types import Array

_FIRST_SHARE = 0.25  # of the limits, how far the first programme may go
_LAST_SHARE = 1e-5
_NO_ERROR = 1e-9  # of the scales
_BELOW_ROUNDING = 1e-12


@dataclass(frozen=True)
class Refined:
    """tracked: the best motion found, and target, what it tracks: the given one, or that `Retimed`. worst: the largest
    error over the scales, of the start and after each programme."""

    tracked: Tracked
    target: Any
    worst: np.ndarray


@partial(jit, static_argnames=("end_effector", "base_mode"))
def rates_followed(robot, target, start, rates, duration, momentum, end_effector, base_mode):
    return track_rates(robot, target, start, rates, duration, momentum, end_effector, base_mode)


errors_linearised = partial(jit, static_argnames=("freedom", "end_effector"))(sensitivity)


def refine_tracking(
    robot: Robot,
    target: Any,
    tracked: Tracked,
    rate_limit: Array | float | None = None,
    acceleration_limit: Array | float | None = None,
    position_scale: float = 0.01,
    attitude_scale: float = np.deg2rad(1.0),
    retime: bool = False,
    freedom: str = ALL,
    iterations: int = 30,
    end_effector: str | None = None,
) -> Refined:
    """The motion near the tracked one whose largest tool error at the samples is least.

    Measured is the largest of |position error|/position_scale, m, and |attitude error|/attitude_scale, rad. Rates keep
    rate_limit (), or (n,), rad/s or m/s, and from rest to rest acceleration_limit, or no more than the given motion's
    where that changes faster; the robot's own limits where these are not given. Joints keep their position limits.
    With retime the pace along the target is free as well, between the same ends and without going back. target: a
    callable that is a pytree. Raises InputError for limits and scales that are not positive and an unknown freedom.
    """
    if freedom not in FREEDOMS:
        raise InputError(f"freedom is {freedom!r}; allowed are {', '.join(FREEDOMS)}")
    for name, value in (("position_scale", position_scale), ("attitude_scale", attitude_scale)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value:g}; it must be positive and finite")
    limits = _Limits(
        _limit("rate_limit", rate_limit, robot.limits.velocity, robot.num_joints),
        _limit("acceleration_limit", acceleration_limit, robot.limits.acceleration, robot.num_joints),
        np.asarray(robot.limits.position_lower),
        np.asarray(robot.limits.position_upper),
    )
    scale = np.repeat([position_scale, attitude_scale], 3)
    motion = tracked.motion
    start = State(motion.base_position[0], motion.base_quaternion[0], motion.joint_position[0])
    duration, mode = motion.time[-1], motion.base_mode

    def followed(rates: np.ndarray, own_time: np.ndarray) -> tuple[Tracked, tuple[np.ndarray, ...], float]:
        found = rates_followed(
            robot,
            Retimed(target, own_time, duration),
            start,
            rates,
            duration,
            motion.momentum,
            end_effector,
            mode,
        )
        linear = tuple(
            np.asarray(x) for x in errors_linearised(robot, target, own_time, found, freedom, end_effector)
        )
        return found, linear, _worst(linear[0] / scale)

    own_time = np.asarray(motion.time)
    rates = np.clip(np.asarray(motion.joint_velocity)[:-1], -limits.rate, limits.rate)
    best, linear, worst = followed(rates, own_time)
    share, history = _FIRST_SHARE, [worst]
    for _ in range(iterations):
        if worst < _NO_ERROR or share < _LAST_SHARE:
            break
        change, pace, expected = _programme(
            linear, scale, limits, rates, np.asarray(best.motion.joint_position), own_time, share, retime
        )
        trial = rates + change, own_time + pace
        found, slopes, value = followed(*trial)
        gained = (worst - value) / max(worst - expected, _BELOW_ROUNDING)
        if value < worst:
            (rates, own_time), best, linear, worst = trial, found, slopes, value
        share *= 2.0 if gained > 0.75 else 0.5 if gained < 0.25 else 1.0
        history.append(worst)
    return Refined(
        best, Retimed(target, jnp.asarray(own_time), duration) if retime else target, np.array(history)
    )


@dataclass(frozen=True)
class _Limits:
    """Largest rates and changes of rate (n,), lower and upper joint positions (n,); infinite where there is none."""

    rate: np.ndarray
    acceleration: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def _limit(name: str, given: Array | float | None, own: Array, n: int) -> np.ndarray:
    values = np.broadcast_to(np.asarray(own if given is None else given, dtype=float), n)
    if not np.all(values > 0):
        raise InputError(f"{name} is {np.min(values):g}; it must be positive")
    return values


def _worst(scaled: np.ndarray) -> float:
    """The largest length of a position or attitude error (K, 6) over its scale; infinite where one is not finite."""
    largest = np.max(np.linalg.norm(scaled.reshape(-1, 3), axis=1))
    return float(largest) if np.isfinite(largest) else np.inf


def _programme(
    linear: tuple[np.ndarray, ...],
    scale: np.ndarray,
    limits: _Limits,
    rates: np.ndarray,
    joints: np.ndarray,
    own_time: np.ndarray,
    share: float,
    retime: bool,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Changes of rates (K, n) and own_time (K + 1,) of the least largest error, and that error, if all were linear."""
    error, by_rates, by_time = linear
    (count, n), step = rates.shape, (own_time[-1] - own_time[0]) / rates.shape[0]
    columns, paces = count * n, count - 1 if retime else 0
    sides = _facets(error / scale)
    slopes = by_rates.reshape(count, 6, columns) / scale[:, None]
    own = np.zeros((count, 6, paces))
    own[np.arange(paces), :, np.arange(paces)] = by_time[:paces] / scale
    rows = np.einsum("kfi,kij->kfj", sides, np.concatenate([slopes, own], axis=2)).reshape(
        -1, columns + paces
    )
    table = [np.concatenate([rows, -np.ones((rows.shape[0], 1))], axis=1)]
    bound = [-np.einsum("kfi,ki->kf", sides, error / scale).ravel()]

    def add(matrix: np.ndarray, most: np.ndarray, first: int = 0) -> None:
        part = np.zeros((matrix.shape[0], columns + paces + 1))
        part[:, first : first + matrix.shape[1]] = matrix
        bounded = np.isfinite(most)
        table.append(part[bounded])
        bound.append(most[bounded])

    # Changes of rate from rest to rest, and positions.
    jumps = np.kron(np.eye(count + 1, count) - np.eye(count + 1, count, -1), np.eye(n))
    now = jumps @ rates.ravel()
    room = np.maximum(np.tile(limits.acceleration * step, count + 1), np.abs(now))
    room[np.tile(np.isinf(limits.acceleration), count + 1)] = np.inf
    sums = np.kron(step * np.tri(count), np.eye(n))
    for sign, wall in ((1, limits.upper), (-1, limits.lower)):
        add(sign * jumps, room - sign * now)
        add(sign * sums, np.maximum(sign * (wall - joints[1:]), 0.0).ravel())
    if retime:
        add(np.eye(count, count - 1, -1) - np.eye(count, count - 1), np.diff(own_time), columns)
    # Where no limit is given, the trust region is about the rates themselves.
    reach = share * np.where(np.isinf(limits.rate), np.max(np.abs(rates)), limits.rate)
    low = np.maximum(-limits.rate - rates, -reach).ravel()
    high = np.minimum(limits.rate - rates, reach).ravel()
    pace = np.full(paces, share * (own_time[-1] - own_time[0]))
    found = linprog(
        np.append(np.zeros(columns + paces), 1.0),
        A_ub=csr_array(np.concatenate(table)),
        b_ub=np.concatenate(bound),
        bounds=np.stack([np.concatenate([low, -pace, [0]]), np.concatenate([high, pace, [np.inf]])], axis=1),
        method="highs-ds",
    )
    if found.x is None:
        return np.zeros_like(rates), np.zeros_like(own_time), np.inf
    change = np.clip(found.x[:columns], low, high).reshape(count, n)
    moved = np.zeros_like(own_time)
    moved[1 : paces + 1] = found.x[columns:-1]
    return change, moved, found.x[-1]


def _facets(scaled: np.ndarray) -> np.ndarray:
    """Directions (K, 14, 6) whose largest component stands for a length: the axes' both ways, and the error's own."""
    axes = np.concatenate([np.eye(6), -np.eye(6)])
    along = np.zeros((scaled.shape[0], 2, 6))
    for part, columns in enumerate((slice(0, 3), slice(3, 6))):
        size = np.linalg.norm(scaled[:, columns], axis=1, keepdims=True)
        along[:, part, columns] = scaled[:, columns] / np.where(size > 0, size, 1.0)
    return np.concatenate([np.broadcast_to(axes, (scaled.shape[0], 12, 6)), along], axis=1)
