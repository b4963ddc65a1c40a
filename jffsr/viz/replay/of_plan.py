"""The replay of a plan, of whatever was optimised in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jffsr.study.reviewing import open_run
from jffsr.viz.replay.curves import run_name, torques
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.replay import Replay


def planned_replays(path: Path) -> list[Replay]:
    """The motion of a planning run, its base coloured by its share of the excursion limit."""
    folder, problem, dataset = open_run(path)
    limit, extras = dataset["excursion_limit"].values, Extras()
    if np.any(np.isfinite(limit)):
        share = np.abs(dataset["attitude_angle"].values) / limit
        extras.nearness = {problem.robot.body_names[0]: share.max(axis=1)}
        allowed = ", ".join(f"{angle:.4g}" for angle in np.unique(np.rad2deg(limit[np.isfinite(limit)])))
        extras.legend = (
            "The base shows how far it has turned from its start, the worst of its axes: red at the excursion limit "
            f"of each ({allowed} deg).",
        )
    if "joint_torque" in dataset:
        extras.panels = (torques(dataset),)
    return [robot_replay(run_name(folder), problem.robot, dataset, extras)]
