"""A finished reactionless run looked at again, and made again in MuJoCo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jffsr.robots.robot import Robot
from jffsr.study.atomic import write_json
from jffsr.study.building import build_robot
from jffsr.study.reactionless.building import build_study
from jffsr.study.reactionless.checking import HoldCheck, check_of
from jffsr.study.reactionless.running import run_hold
from jffsr.study.reviewing import open_result
from jffsr.study.run_folder import RunFolder


def open_runs(path: str | Path) -> tuple[RunFolder, Robot, Any]:
    """The folder, robot and dataset of a finished reactionless run; InputError where something is missing."""
    folder = RunFolder(Path(path))
    robot = build_robot(folder.read_config())
    return folder, robot, open_result(folder, folder.result, "settled_base_rate")


def check_run(path: str | Path) -> HoldCheck:
    """The first seed of every run with MuJoCo as the plant, beside ours; the report goes into the run's summary."""
    folder = RunFolder(Path(path))
    summary, config = folder.read_summary(), folder.read_config()
    study = build_study(config)
    pairs = []
    for name, hold in config.holds.items():
        (mujoco,) = run_hold(config, study, hold, in_mujoco=True)
        # All seeds, for that program is kept.
        pairs.append((name, mujoco, run_hold(config, study, hold, config.seeds)[0]))
    found = check_of(pairs)
    summary["verification"]["mujoco"] = found.to_dict()
    write_json(folder.summary, summary)
    return found
