"""From the sections `task` and `trajectory` to a joint law of the robot."""

from __future__ import annotations

import numpy as np

from jffsr.errors import InputError
from jffsr.planning.reachability import check_duration_possible
from jffsr.robots.robot import PRISMATIC, Robot
from jffsr.study.degrees import refuse_degrees
from jffsr.study.schema import PlanningConfig
from jffsr.study.schema_solver import BSPLINE, POLYNOMIAL, SINE_POLYNOMIAL
from jffsr.trajectories.bspline import ClampedBSpline
from jffsr.trajectories.interface import PlannedTrajectory
from jffsr.trajectories.polynomial import Polynomial
from jffsr.trajectories.sine_polynomial import SinePolynomial


def build_trajectory(config: PlanningConfig, robot: Robot) -> PlannedTrajectory:
    """The joint law from start to goal; InputError with file, line and key where the robot cannot follow it."""
    task, law = config.task, config.trajectory
    start, goal = np.array(task.start_si), np.array(task.goal_si)
    for quantity, value in (("start", start), ("goal", goal)):
        _check_posture(config, robot, quantity, value)
    shortest, longest = task.duration_range
    check_duration_possible(robot, start, goal, longest, config.where("task.duration"))
    shared = {"box": law.box, "duration_bounds": (shortest, longest) if task.duration_is_free else None}
    if law.kind == POLYNOMIAL:
        return Polynomial.between(start, goal, longest, law.degree, **shared)
    lower, upper = robot.limits.position_lower, robot.limits.position_upper
    shared["joint_names"] = robot.joint_names
    if law.kind == BSPLINE:
        sizes = (law.degree, law.control_points)
        return ClampedBSpline.between(start, goal, longest, *sizes, lower, upper, **shared)
    return SinePolynomial.between(start, goal, lower, upper, longest, **shared)


def _check_posture(config: PlanningConfig, robot: Robot, quantity: str, value: np.ndarray) -> None:
    refuse_degrees(config, "task", quantity, robot)
    key, strict = config.task.key_of(quantity), config.trajectory.kind == SINE_POLYNOMIAL
    where = config.where(f"task.{key}")
    if value.size != robot.num_joints:
        raise InputError(
            f"{where}: found a list of {value.size}, robot '{robot.name}' has {robot.num_joints} joints "
            f"({', '.join(robot.joint_names)})"
        )
    for i, name in enumerate(robot.joint_names):
        low, high = robot.limits.position_lower[i], robot.limits.position_upper[i]
        if strict and not (np.isfinite(low) and np.isfinite(high)):
            suffix, turn = (
                ("", "[-1, 1]") if robot.topology.joint_types[i] == PRISMATIC else ("_deg", "[-180, 180]")
            )
            raise InputError(
                f"{config.where('limits')}: {name} of robot '{robot.name}' has no position limits, which the "
                f"sine-polynomial law needs; give them by name, such as "
                f"'limits: {{position{suffix}: {{{name}: {turn}}}}}', or another trajectory.kind"
            )
        inside = low < value[i] < high if strict else low <= value[i] <= high
        if not inside:
            slides = robot.topology.joint_types[i] == PRISMATIC
            shown = [
                x if slides or not key.endswith("_deg") else np.rad2deg(x) for x in (value[i], low, high)
            ]
            unit = "m" if slides else ("deg" if key.endswith("_deg") else "rad")
            place = "on a limit of" if value[i] in (low, high) else "outside"
            expected = "a value strictly inside" if strict else "a value inside"
            raise InputError(
                f"{where}: {name}: {shown[0]:g} {unit} lies {place} its range [{shown[1]:g}, {shown[2]:g}] {unit}; "
                f"{expected} is expected"
            )
