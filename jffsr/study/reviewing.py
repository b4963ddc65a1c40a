"""Looking at a finished run again, and its cross-check with MuJoCo and MJX."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.planning.problem import Problem
from jffsr.study.atomic import write_json
from jffsr.study.building import build_problem
from jffsr.study.dataset import open_dataset
from jffsr.study.run_folder import RunFolder

if TYPE_CHECKING:
    from jffsr.study.tracking.building import TrackingTask


def open_run(path: str | Path) -> tuple[RunFolder, Problem, Any]:
    """The folder, the problem and the dataset of a finished run; InputError where something is missing."""
    folder = RunFolder(Path(path))
    problem = build_problem(folder.read_config())
    dataset = open_result(folder, folder.result, "free_numbers")
    free = dataset["free_numbers"].to_numpy()
    lower, _ = problem.bounds()
    if free.shape != lower.shape or not np.all(np.isfinite(free)):
        raise InputError(f"{folder.result}: holds no plan of {folder.config} (free numbers {free.shape})")
    return folder, problem, dataset


def open_tracking(path: str | Path) -> tuple[RunFolder, TrackingTask, Any]:
    """The folder, the task and the dataset of a finished tracking run; InputError where something is missing."""
    from jffsr.study.tracking.building import build_task

    folder = RunFolder(Path(path))
    return folder, build_task(folder.read_config()), open_result(folder, folder.result, "pose_error")


def open_result(folder: RunFolder, file: Path, variable: str) -> Any:
    """A dataset of a finished run, which holds this variable; InputError where it cannot be read."""
    folder.read_summary()
    try:
        dataset = open_dataset(file)
        dataset[variable].load()
    except Exception as error:
        raise InputError(f"{file}: cannot be read ({error})") from None
    return dataset


def check_run(path: str | Path, steps: tuple[float, ...] = (2e-3, 1e-3)):
    """Re-verify a finished run in MuJoCo and MJX; the report goes into its summary and is returned."""
    from jffsr.crosscheck.compare import crosscheck

    folder, problem, dataset = open_run(path)
    if problem.base_mode != FLOATING:
        raise InputError(
            f"{folder.config}: rollout.base_mode is '{problem.base_mode}'; only floating bases are driven in MuJoCo "
            f"and MJX"
        )
    trajectory = problem.trajectory.with_free(dataset["free_numbers"].to_numpy())
    report = crosscheck(
        problem.robot,
        trajectory,
        problem.initial_state,
        momentum=problem.momentum,
        steps=steps,
    )
    summary = folder.read_summary()
    summary["verification"]["mujoco"] = report.to_dict()
    write_json(folder.summary, summary)
    return report
