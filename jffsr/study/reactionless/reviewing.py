"""A finished reactionless run looked at again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jffsr.robots.robot import Robot
from jffsr.study.building import build_robot
from jffsr.study.reviewing import open_result
from jffsr.study.run_folder import RunFolder


def open_runs(path: str | Path) -> tuple[RunFolder, Robot, Any]:
    """The folder, robot and dataset of a finished reactionless run; InputError where something is missing."""
    folder = RunFolder(Path(path))
    robot = build_robot(folder.read_config())
    return folder, robot, open_result(folder, folder.result, "settled_base_rate")
