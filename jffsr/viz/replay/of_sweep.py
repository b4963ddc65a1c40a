"""The replays of a sweep: the best motion of each of its best settings."""

from __future__ import annotations

from pathlib import Path

import jax
import numpy as np

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.objectives.terms import attitude_angles
from jffsr.planning.problem import Problem
from jffsr.study.building import build_problem
from jffsr.study.dataset import excursion_limit, open_dataset
from jffsr.study.sweep.ended import read_ended
from jffsr.study.sweep.folder import SweepFolder
from jffsr.study.sweep.points import expand, value_text
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.sweep.table import rows_of
from jffsr.types import Vector
from jffsr.viz.replay.of_plan import planned_extras
from jffsr.viz.replay.of_robot import robot_replay
from jffsr.viz.replay.replay import NothingMoved, Replay

SETTINGS = 4
"""How many settings are shown, those with the least cost."""


def sweep_replays(path: Path) -> list[Replay]:
    """The best point of each of the best settings of a finished sweep, computed again from its free numbers.

    Raises InputError where the sweep is not finished, or no point of it has a motion.
    """
    folder = SweepFolder(path)
    read_ended(path)
    try:
        dataset = open_dataset(folder.result)
    except Exception as error:
        raise InputError(f"{folder.result}: cannot be read ({error})") from None
    points = expand(read_sweep(str(folder.config)))
    chosen = []
    for row in rows_of(dataset):
        finite = np.flatnonzero(np.isfinite(row.cost))
        if len(finite):
            best = finite[np.argmin(row.cost[finite])]
            title = ", ".join(
                f"{key.rpartition('.')[2]} {value_text(value)}" for key, value in row.values.items()
            )
            chosen.append((float(row.cost[best]), int(row.points[best]), title or "best"))
    if not chosen:
        raise NothingMoved(f"{folder.path}: no point of this sweep has a motion to show")
    chosen = sorted(chosen)[:SETTINGS]
    return [
        _replay(
            build_problem(points[point].config), dataset["free_numbers"].values[point], title, len(chosen)
        )
        for _, point, title in chosen
    ]


@program(static_argnums=2, once=True)
def _motion(problem: Problem, free: Vector, measure: str):
    motion = problem.motion(free)
    return motion, attitude_angles(motion, measure)


def _replay(problem: Problem, free: np.ndarray, title: str, together: int) -> Replay:
    import xarray

    limit, measure = excursion_limit(problem)
    motion, angles = jax.device_get(_motion(problem, free[: problem.bounds()[0].shape[0]], measure))
    dataset = xarray.Dataset(
        {
            "joint_position": (("time", "joint"), motion.joint_position),
            "joint_velocity": (("time", "joint"), motion.joint_velocity),
            "base_position": (("time", "axis"), motion.base_position),
            "base_quaternion": (("time", "component"), motion.base_quaternion),
            "base_twist": (("time", "twist"), motion.base_twist),
            "attitude_angle": (("time", "axis"), angles),
        },
        coords={"time": np.asarray(motion.time)},
    )
    extras = planned_extras(problem, dataset, limit)
    return robot_replay(title, problem.robot, dataset, extras, together=together)
