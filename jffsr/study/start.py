"""From a section `task` of `schema_start` to the robot's state and its tool."""

from __future__ import annotations

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.study.degrees import refuse_degrees
from jffsr.study.robot_study import RobotStudy


def start_state(config: RobotStudy, robot: Robot) -> State:
    """The state at the start, at rest of the joints; InputError where the robot cannot be so."""
    task = config.task
    refuse_degrees(config, "task", "start", robot)
    where, q = config.where(f"task.{task.key_of('start')}"), np.array(task.si("start"))
    if q.size != robot.num_joints:
        raise InputError(
            f"{where}: found a list of {q.size}, robot '{robot.name}' has {robot.num_joints} joints"
        )
    lower, upper = robot.limits.position_lower, robot.limits.position_upper
    for i in np.flatnonzero((q < lower) | (q > upper)):
        raise InputError(
            f"{where}: {robot.joint_names[i]}: {q[i]:g} lies outside its range [{lower[i]:g}, {upper[i]:g}] "
            "(rad or m); a value inside is expected"
        )
    return State(np.array(task.base_position), np.array(task.base_quaternion), q)


def chosen_end_effector(config: RobotStudy, robot: Robot, purpose: str) -> str:
    """The name of the end effector, the robot's first for null; InputError where there is none, which could do that."""
    names, asked = robot.end_effector_names, config.task.end_effector
    if not names:
        raise InputError(
            f"{config.where('robot')}: robot '{robot.name}' has no end effector, which could {purpose}"
        )
    if asked is not None and asked not in names:
        raise InputError(
            f"{config.where('task.end_effector')}: found '{asked}', robot '{robot.name}' has {', '.join(names)}"
        )
    return asked or names[0]
