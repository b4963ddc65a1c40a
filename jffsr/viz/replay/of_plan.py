"""The replay of a plan, of whatever was optimised in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jffsr.robots.robot import Robot
from jffsr.study.reviewing import open_run
from jffsr.viz.replay.curves import run_name, torques
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.replay import Replay


def planned_replays(path: Path) -> list[Replay]:
    """The motion of a planning run, its base coloured by its share of the excursion limit."""
    folder, problem, dataset = open_run(path)
    extras = excursion(problem.robot, dataset["attitude_angle"].values, dataset["excursion_limit"].values)
    if "joint_torque" in dataset:
        extras.panels = (torques(dataset),)
    return [robot_replay(run_name(folder), problem.robot, dataset, extras)]


def excursion(robot: Robot, angles: np.ndarray, limit: np.ndarray) -> Extras:
    """The base's share of its excursion limit (3,), rad, at angles (N + 1, 3), rad; nothing where there is none."""
    extras = Extras()
    if np.any(np.isfinite(limit)):
        share = np.abs(angles) / limit
        extras.nearness = {robot.body_names[0]: share.max(axis=1)}
        allowed = ", ".join(f"{angle:.4g}" for angle in np.unique(np.rad2deg(limit[np.isfinite(limit)])))
        extras.legend = (
            "The base shows how far it has turned from its start, the worst of its axes: red at the excursion limit "
            f"of each ({allowed} deg).",
        )
    return extras
