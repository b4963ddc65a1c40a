"""The minimum-torque task of Hu, Wang and Shi 2011 on its planar arm, at any degree."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.torque_terms import AttitudePenalty, TorqueIntegral
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.trajectories.polynomial import Polynomial

START, GOAL, DURATION = np.deg2rad([90, 30]), np.deg2rad([-60, 90]), 10.0
HALF_TURN = np.deg2rad(-40) / 2
ATTITUDE = np.array([np.cos(HALF_TURN), 0, 0, np.sin(HALF_TURN)])
DESIRED = np.array([1.0, 0, 0, 0])


def hu_problem(robot: Robot, degree: int = 7, num_steps: int = 100, alpha: float = 1e6) -> Problem:
    """The index is the torque integral, N m s, plus alpha times the squared final attitude error."""
    terms = TorqueIntegral(np.array(1.0)), AttitudePenalty(np.array(1 / alpha), DESIRED)
    return Problem(
        robot,
        Polynomial.between(START, GOAL, DURATION, degree),
        CompositeIndex(terms),
        initial_state=State(np.zeros(3), ATTITUDE, START),
        num_steps=num_steps,
    )


def final_angle(motion):
    """The base's angle about z at the end, rad."""
    w, _, _, z = motion.base_quaternion[-1]
    return 2 * jnp.arctan2(z, w)
