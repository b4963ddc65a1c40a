"""The best motion that a planning run has found so far, from its checkpoint."""

from __future__ import annotations

import math
from pathlib import Path

import jax
import numpy as np
import xarray

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.planning.problem import Problem
from jffsr.planning.search import search_of
from jffsr.rollouts.motion import Motion
from jffsr.study.building import build_problem, build_settings
from jffsr.study.checkpoint import load_checkpoint
from jffsr.study.run_folder import RunFolder
from jffsr.viz.replay.of_robot import robot_replay
from jffsr.viz.replay.replay import Replay

_NAMES = ("joint_position", "joint_velocity", "base_position", "base_quaternion", "base_twist")


@program(once=True)
def _motion(problem: Problem, candidate: np.ndarray) -> Motion:
    return problem.motion(candidate)


def best_replay(path: Path) -> Replay:
    """The replay of the best motion in a planning run's checkpoint, which says how far the search was.

    Raises InputError where there is no checkpoint, none that can be read, or no motion in it yet.
    """
    folder = RunFolder(path)
    config = folder.read_config()
    if config.kind != "planning":
        raise InputError(f"{path}: a run of kind {config.kind} keeps no motion while it is under way")
    if not folder.checkpoint.is_file():
        raise InputError(f"{path}: there is no checkpoint, and so no motion, yet")
    with jax.enable_x64(config.precision == "float64"):
        problem = build_problem(config)
        phases, searched = search_of(problem, *build_settings(config))
        snapshot = load_checkpoint(folder.checkpoint, phases, searched, jax.random.key(config.seed))
        last = snapshot.history[-1]
        if not math.isfinite(last.best_value):
            raise InputError(f"{path}: the search has found no motion yet")
        motion = jax.device_get(_motion(problem, np.asarray(snapshot.state.progress.best_position)))
        dataset = xarray.Dataset(
            {name: (("time", f"{name}_part"), np.asarray(getattr(motion, name), float)) for name in _NAMES},
            coords={"time": np.asarray(motion.time, float)},
        )
        title = f"best after {last.evaluations} evaluations, {last.gradient_evaluations} gradients"
        return robot_replay(title, problem.robot, dataset)
