"""A capture by a planar arm that is known to be possible: the target is put where a motion of the arm leads."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np

import jffsr
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.problem import capture_problem
from jffsr.capture.tool_motion import tool_samples
from jffsr.planning.problem import Problem
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

DURATION = 20.0
START = np.array([0.4, 0.8, -0.6])
GRASP = np.array([-0.4, 0.1, 0.0])
WAY = np.array([[0.1, -0.1, 0.1], [0.3, -0.3, 0.35], [0.55, -0.5, 0.6], [0.62, -0.55, 0.68]])
"""Free control points less the start, (4, 3), rad, of a motion that ends as the target is grasped."""


def about_z(angle: float) -> np.ndarray:
    """The quaternion of a turn about z by `angle`, rad."""
    return np.array([np.cos(angle / 2), 0.0, 0.0, np.sin(angle / 2)])


def _problem(robot, path, num_steps: int) -> Problem:
    state = jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), START)
    return capture_problem(
        robot, path, state, DURATION, half_angle=None, control_points=7, num_steps=num_steps
    )


def planar_capture(num_steps: int = 32) -> tuple[Problem, np.ndarray]:
    """The problem, and free numbers (12,) that solve it but for the difference of the grids."""
    robot = jffsr.load_robot("ye_2019_planar3")
    limits = replace(
        robot.limits,
        position_lower=np.full(3, -2.5),
        position_upper=np.full(3, 2.5),
        velocity=np.full(3, 0.15),
        acceleration=np.full(3, 0.05),
    )
    robot = replace(robot, limits=limits)
    free = (START + WAY).ravel()
    anywhere = GraspPath.create(_moving(np.zeros(3), np.zeros(3), 0.0, 0.0))
    last = [num_steps]
    tool = jax.device_get(
        jax.jit(lambda p: tool_samples(robot, p.motion(free), None, last)[0])(
            _problem(robot, anywhere, num_steps)
        )
    )
    angle = 2 * np.arctan2(tool.quaternion[3], tool.quaternion[0])
    rate = tool.twist[5]
    c, s = np.cos(angle), np.sin(angle)
    arm = np.array([c * GRASP[0] - s * GRASP[1], s * GRASP[0] + c * GRASP[1], 0.0])
    velocity = tool.twist[:3] - np.cross([0.0, 0.0, rate], arm)
    begin = tool.position - arm - DURATION * velocity
    motion = _moving(begin, velocity, angle - DURATION * rate, rate)
    return _problem(robot, GraspPath.create(motion), num_steps), free


def _moving(position, velocity, angle: float, rate: float):
    target = Target.create((2.0, 2.5, 3.0), 10.0, grasps={"handle": (GRASP, np.array([1.0, 0.0, 0.0, 0.0]))})
    state = TargetState.create(position, velocity, about_z(angle), (0.0, 0.0, rate))
    return target_motion(target, state, DURATION + 1.0, 8)
