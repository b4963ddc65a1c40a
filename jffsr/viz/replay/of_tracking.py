"""The replays of a tracking study: one for each tracker, beside the way that was asked of the tool."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from jffsr.study.reviewing import open_tracking
from jffsr.viz.replay.curves import positive, run_name, while_finite
from jffsr.viz.replay.of_robot import Extras, robot_replay
from jffsr.viz.replay.replay import NothingMoved, Panel, Replay, Way

_ASKED = (0.20, 0.60, 0.35)


def tracked_replays(path: Path) -> list[Replay]:
    """The motion of every tracker, up to where it was lost; NothingMoved where none moved."""
    folder, task, dataset = open_tracking(path)
    found = []
    for label in dataset["tracker"].values:
        one = while_finite(dataset.sel(tracker=label))
        if one.sizes["time"] < 2:
            continue
        time, error = one["time"].values, one["pose_error"].values
        values = one["singular_values"].values
        values = values[:, ~np.all(np.isnan(values), axis=0)]
        target = one["target_position"].values
        extras = Extras(
            ways=(Way("way asked of the tool", target, _ASKED, ahead=True),),
            axes=(("asked of the tool", target, one["target_quaternion"].values),),
            panels=(
                Panel(
                    "tool off its way",
                    "mm, mrad",
                    time,
                    {
                        "position": positive(1e3 * np.linalg.norm(error[:, :3], axis=1)),
                        "attitude": positive(1e3 * np.linalg.norm(error[:, 3:], axis=1)),
                    },
                    logarithmic=True,
                ),
                Panel(
                    "smallest singular value",
                    "1",
                    time,
                    {"singular value": positive(values[:, -1])},
                    logarithmic=True,
                ),
            ),
            legend=("Green: the way that was asked of the tool.",),
        )
        name = str(label) or run_name(folder)
        found.append(robot_replay(name, task.robot, one, extras, dataset.sizes["tracker"]))
    if not found:
        raise NothingMoved(f"{folder.path}: no tracker of this run moved")
    return found
