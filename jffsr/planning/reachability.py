"""The least time that a rest-to-rest joint motion needs under its limits: what no optimizer can better."""

from __future__ import annotations

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import PRISMATIC, Robot


def least_durations(robot: Robot, start: np.ndarray, goal: np.ndarray) -> np.ndarray:
    """Least time (n,), s, of each joint from rest to rest under its rate and acceleration limits.

    Bang-bang in the acceleration, with a coast where the rate limit is met: 2 sqrt(d/a) if sqrt(d a) <= v,
    else d/v + v/a. Infinite limits count as none.
    """
    distance = np.abs(np.asarray(goal) - np.asarray(start))
    rate, acceleration = robot.limits.velocity, robot.limits.acceleration
    with np.errstate(divide="ignore", invalid="ignore"):
        peak = np.sqrt(distance * acceleration)
        triangle = np.where(np.isinf(acceleration), 0.0, 2 * np.sqrt(distance / acceleration))
        trapezoid = distance / rate + np.where(np.isinf(acceleration), 0.0, rate / acceleration)
    return np.where(distance == 0, 0.0, np.where(peak <= rate, triangle, trapezoid))


def check_duration_possible(
    robot: Robot, start: np.ndarray, goal: np.ndarray, duration: float, where: str = "duration"
) -> None:
    """Refuse a duration that is too short for some joint, naming joint, limit and the least time."""
    least = least_durations(robot, start, goal)
    if not np.any(least > duration):
        return
    sentences = []
    for i in np.flatnonzero(least >= 0.999 * least.max()):
        unit, turn = (
            ("m", goal[i] - start[i]) if _slides(robot, i) else ("deg", np.rad2deg(goal[i] - start[i]))
        )
        per = "m" if _slides(robot, i) else "rad"
        rate, acceleration = robot.limits.velocity[i], robot.limits.acceleration[i]
        alone = 2 * np.sqrt(abs(goal[i] - start[i]) / acceleration) if np.isfinite(acceleration) else 0.0
        sentences.append(
            f"{robot.joint_names[i]} moves {abs(turn):.4g} {unit} from rest to rest, which needs {alone:.2f} s under "
            f"its acceleration limit of {acceleration:.4g} {per}/s^2 alone and {least[i]:.2f} s with its rate limit "
            f"of {rate:.4g} {per}/s as well"
        )
    raise InputError(
        f"{where}: found {duration:g} s, at least {least.max():.2f} s is needed: " + "; ".join(sentences)
    )


def _slides(robot: Robot, joint: int) -> bool:
    return robot.topology.joint_types[joint] == PRISMATIC
