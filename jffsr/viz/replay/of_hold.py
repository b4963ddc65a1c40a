"""The replays of a reactionless study: one for each estimator or controller that it compares."""

from __future__ import annotations

from pathlib import Path

from jffsr.study.reactionless.reviewing import open_runs
from jffsr.viz.replay.curves import base_rate, run_name, torques, while_finite
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.replay import NothingMoved, Replay


def held_replays(path: Path) -> list[Replay]:
    """The motion of every run of a study, up to where it was lost; NothingMoved where nothing moved."""
    folder, robot, dataset = open_runs(path)
    found = []
    for name in dataset["run"].values:
        one = while_finite(dataset.sel(run=name))
        if one.sizes["time"] >= 2:
            extras = Extras(panels=(base_rate(one), torques(one)))
            found.append(robot_replay(str(name), robot, one, extras, dataset.sizes["run"]))
    if not found:
        raise NothingMoved(f"{folder.path}: nothing moved in '{run_name(folder)}'")
    return found
