"""A capture as a planning problem: a clamped B-spline from rest to the moving grasp frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jffsr.capture.approach import HALF_ANGLE, ApproachCone
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import GraspMatch
from jffsr.capture.terms import BaseDisturbance
from jffsr.dynamics.base_mode import FLOATING
from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.constraints import Constraint, joint_limits
from jffsr.objectives.terms import Term
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.trajectories.bspline import ClampedBSpline
from jffsr.types import Array

NUM_STEPS = 50


def capture_problem(
    robot: Robot,
    path: GraspPath,
    initial_state: State,
    duration: float,
    *,
    duration_bounds: tuple[float, float] | None = None,
    terms: Sequence[Term] | None = None,
    clearance: Constraint | None = None,
    half_angle: float | None = HALF_ANGLE,
    control_points: int = 8,
    degree: int = 4,
    num_steps: int = NUM_STEPS,
    tolerance: float = 1e-6,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = FLOATING,
    accuracy: float = np.inf,
    joint_acceleration: Array | None = None,
) -> Problem:
    """The problem whose solutions bring the tool to the grasp frame with its velocity, inside every limit.

    The joints start as initial_state has them, at rest or, where it has a joint_velocity, with that and
    joint_acceleration (n,), and follow a clamped B-spline over `duration`, s, which is free within duration_bounds
    where they are given; its control points stay within the position limits, and so does a curve that starts at rest.
    Constraints: the grasp's pose and twist to `tolerance` (m, rad, m/s, rad/s), rates and accelerations, the approach
    cone of half_angle, rad (None leaves it out), and `clearance`. terms, by default the base's disturbance, are what is
    made small; `accuracy`, the index that counts as met, is infinite: what keeps the constraints is a success. Raises
    InputError where the start lies beyond a position limit.
    """
    limits = robot.limits
    law = ClampedBSpline.between(
        start=initial_state.joint_position,
        goal=None,
        duration=duration,
        degree=degree,
        control_points=control_points,
        lower=limits.position_lower,
        upper=limits.position_upper,
        box=4 * np.pi,
        duration_bounds=duration_bounds,
        joint_names=robot.joint_names,
        start_rate=initial_state.joint_velocity,
        start_acceleration=joint_acceleration,
    )
    kept = ("rate", "acceleration") if law.start_rate is None else ("position", "rate", "acceleration")
    robot.end_effector_index(end_effector)
    constraints: list[Constraint] = [
        GraspMatch(path, np.asarray(tolerance), end_effector),
        joint_limits(robot, kept),
    ]
    if half_angle is not None:
        constraints.append(ApproachCone(path, np.asarray(half_angle), end_effector=end_effector))
    if clearance is not None:
        constraints.append(clearance)
    return Problem(
        robot=robot,
        trajectory=law,
        objective=CompositeIndex(
            tuple(terms) if terms else (BaseDisturbance(np.asarray(1.0)),), accuracy=np.asarray(accuracy)
        ),
        initial_state=initial_state,
        momentum=np.zeros(6) if momentum is None else momentum,
        num_steps=num_steps,
        base_mode=base_mode,
        constraints=tuple(constraints),
    )
