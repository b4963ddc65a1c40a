"""A robot of the catalogue or of a file, drawn to a file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.loading import load_robot
from jffsr.robots.robot import Robot
from jffsr.viz.robot import draw_still
from jffsr.viz.save import save_picture


def draw_to_file(name: str, out: str | None = None, posture: str | None = None) -> tuple[Path, str]:
    """Draw a robot to the .png `out`; where it went, and the posture as text.

    name is a catalogue name or a robot file, None for out the robot's name in the current folder. posture is
    one number a joint, in degrees (prismatic: m), parted by commas; None as in `draw_still`. InputError for a
    posture that does not fit, and for a file that cannot be written.
    """
    robot = load_robot(name)
    turns = np.where(robot.topology.is_revolute, np.pi / 180, 1.0)
    path = Path(out if out is not None else re.sub(r"[^\w.-]", "_", robot.name) + ".png")
    still = draw_still(robot, None if posture is None else _read_posture(robot, posture) * turns)
    save_picture(still.figure, path)
    numbers = ", ".join(f"{value:.4g}" for value in still.posture / turns)
    unit = "deg" if robot.topology.is_revolute.all() else "deg and m"
    return path, f"({numbers}) {unit}"


def _read_posture(robot: Robot, text: str) -> np.ndarray:
    try:
        numbers = np.array([float(word) for word in text.split(",")])
    except ValueError:
        numbers = np.zeros(0)
    if numbers.shape != (robot.num_joints,) or not np.all(np.isfinite(numbers)):
        raise InputError(
            f"--posture '{text[:200]}': robot '{robot.name}' has {robot.num_joints} joints, "
            f"{robot.num_joints} numbers parted by commas are needed"
        )
    return numbers
