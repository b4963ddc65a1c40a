"""Three tasks of the planar two-link arm, and how they are planned, alike in every process that compares them."""

from __future__ import annotations

import numpy as np
from wu6_problems import limited, wu6_problem

from jffsr.optimizers.registry import Settings
from jffsr.planning.many import Plans, plan_many
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot

SETTINGS = Settings(particles=6, evaluations=30)
CHUNK = 2


def planar(robot: Robot, duration: float, **keywords) -> Problem:
    """One task; keywords go to `wu6_problem`."""
    start, goal = np.array([1.5, 0.5]), np.array([-1.0, 1.5])
    return wu6_problem(robot, 16, duration, start=start, goal=goal, **keywords)


def planar_problems(robot: Robot) -> list[Problem]:
    """Three of them, which take different times."""
    return [planar(limited(robot), duration) for duration in (20.0, 25.0, 31.0)]


def plan_in_chunks(problems: list[Problem], **keywords) -> Plans:
    """Their plans, two at a time, so that the second chunk is padded."""
    return plan_many(problems, "qpso", SETTINGS, chunk=CHUNK, **keywords)
