"""The six-axis arm of Wu et al. 2018 as a planning problem, small enough for tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jffsr.objectives.composite import composite_index
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot
from jffsr.trajectories.sine_polynomial import SinePolynomial

START = np.deg2rad([175, -60, -60, 0, 210, 5])
GOAL = np.deg2rad([120, -30, -95, 40, 170, 60])


def limited(robot: Robot, rate: float = 0.25, acceleration: float = 0.2, position: float = 324.0) -> Robot:
    """The robot with the same limits at every joint: rad/s, rad/s^2, and degrees either way."""
    n = robot.num_joints
    limits = replace(
        robot.limits,
        position_lower=np.full(n, -np.deg2rad(position)),
        position_upper=np.full(n, np.deg2rad(position)),
        velocity=np.full(n, rate),
        acceleration=np.full(n, acceleration),
    )
    return robot.replace(limits=limits)


def wu6_problem(
    robot: Robot,
    num_steps: int = 12,
    duration: float = 30.0,
    start=START,
    goal=GOAL,
    momentum=None,
    **objective,
) -> Problem:
    """A rest-to-rest motion; keywords go to `composite_index`, an excursion limit of 10 degrees by default."""
    lower, upper = robot.limits.position_lower, robot.limits.position_upper
    bounds = objective.pop("duration_bounds", None)
    trajectory = SinePolynomial.between(start, goal, lower, upper, duration, duration_bounds=bounds)
    objective.setdefault("excursion_limit", np.deg2rad(10))
    index = composite_index(robot, joint_goal=goal, **objective)
    momentum = np.zeros(6) if momentum is None else np.asarray(momentum, dtype=float)
    return Problem(robot, trajectory, index, momentum=momentum, num_steps=num_steps)
