"""Degrees are for joints that turn."""

from __future__ import annotations

from jffsr.errors import InputError
from jffsr.robots.robot import PRISMATIC, Robot
from jffsr.study.robot_study import RobotStudy


def refuse_degrees(config: RobotStudy, section: str, quantity: str, robot: Robot) -> None:
    """InputError where numbers of the robot's joints are given in degrees, and one of these joints slides."""
    part = getattr(config, section)
    key = part.key_of(quantity)
    value = getattr(part, key)
    if not key.endswith("_deg"):
        return
    for name, kind in zip(robot.joint_names, robot.topology.joint_types, strict=True):
        if kind == PRISMATIC and (not isinstance(value, dict) or name in value):
            raise InputError(
                f"{config.where(f'{section}.{key}')}: joint '{name}' slides, and is not given in degrees; give "
                f"'{quantity}', in SI units"
            )
