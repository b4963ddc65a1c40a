"""A finished tracking run driven again in MuJoCo."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.study.atomic import write_json
from jffsr.study.reviewing import open_tracking
from jffsr.study.tracking.building import build_tracker
from jffsr.study.tracking.running import TUNED
from jffsr.study.tracking.tracked_path import track_task
from jffsr.tracking.mujoco_check import check_tracked
from jffsr.tracking.mujoco_report import TrackedCheck

# A run repeated on another machine may round otherwise; beyond, the folder's motion is another one.
_SAME = 1e-6


def check_tracking(path: str | Path) -> TrackedCheck:
    """The motion that the run was judged by, made again in MuJoCo; the report goes into its summary and is returned.

    The motion is tracked anew from the run's configuration and the numbers in its summary. Raises InputError where it
    is not the one of the folder, and for what `check_tracked` refuses.
    """
    folder, task, dataset = open_tracking(path)
    config, summary = folder.read_config(), folder.read_summary()
    label = summary["judged"]
    section = config.tracker if label == TUNED else config.trackers[label]
    numbers = {name: np.array(value) for name, value in summary["trackers"][label]["numbers"].items()}
    plain = config.verification.model_copy(update={"singularities": False})
    config = config.model_copy(update={"verification": plain})
    found = track_task(config, task, replace(build_tracker(section), **numbers))
    kept = dataset["joint_position"].sel(tracker=label).to_numpy()
    stride = (found.tracked.motion.joint_position.shape[0] - 1) // (kept.shape[0] - 1)
    apart = float(np.max(np.abs(found.tracked.motion.joint_position[::stride] - kept)))
    if not apart <= _SAME:
        raise InputError(
            f"{folder.result}: holds no motion of {folder.config} (joints differ by {apart:.3g})"
        )
    report = check_tracked(task.robot, found.tracked, task.end_effector)
    summary["verification"]["mujoco"] = report.to_dict()
    write_json(folder.summary, summary)
    return report
