"""The replay of a plan, of whatever was optimised in it, and how near its limits it comes."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from jffsr.objectives.clearance import Clearance
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot
from jffsr.study.reviewing import open_run
from jffsr.viz.replay.apart import add_clearance
from jffsr.viz.replay.curves import run_name, torques
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.replay import Replay

if TYPE_CHECKING:
    from xarray import Dataset

_POSES = ("time", "base_position", "base_quaternion", "joint_position")


def planned_replays(path: Path) -> list[Replay]:
    """The motion of a planning run; see `planned_extras` for what its colours show."""
    folder, problem, dataset = open_run(path)
    extras = planned_extras(problem, dataset, dataset["excursion_limit"].values)
    if "joint_torque" in dataset:
        extras.panels += (torques(dataset),)
    return [robot_replay(run_name(folder), problem.robot, dataset, extras)]


def planned_extras(problem: Problem, dataset: Dataset, limit: np.ndarray) -> Extras:
    """What a plan adds to its robot's replay: the base's share of the excursion limit (3,), rad, and clearances.

    dataset has a motion's variables over `time`, and the base's attitude angles.
    """
    extras = excursion(problem.robot, dataset["attitude_angle"].values, limit)
    for constraint in problem.constraints:
        if isinstance(constraint, Clearance):
            motion = SimpleNamespace(**{name: dataset[name].values for name in _POSES})
            apart = np.asarray(constraint.distances(problem.robot, motion))
            margin = float(np.asarray(constraint.margin))
            add_clearance(
                extras, motion.time, apart, constraint.model.pair_names, margin, "The robot's bodies show"
            )
    return extras


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
