"""A tracking study: every tracker on the path, verified; before that, where asked for, the search for its numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.registry import build_phases
from jffsr.parallel.processes import is_first
from jffsr.planning.stopwatch import Stopwatch
from jffsr.study.atomic import write_json
from jffsr.study.claiming import Run, claim, shared_summary
from jffsr.study.dataset import save_dataset
from jffsr.study.searching import kept_search
from jffsr.study.tracking.building import TrackingTask, build_task, build_tracker, build_tuning
from jffsr.study.tracking.dataset import tracking_dataset
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.study.tracking.summary import tracking_summary
from jffsr.study.tracking.tracked_path import track_task
from jffsr.study.unused import unused_keys
from jffsr.tracking.outcome import check_path
from jffsr.tracking.tracker import Tracker, check_gains, check_tracker
from jffsr.tracking.tracking import samples

TUNED = "tuned"
_PATH_POINTS = 201


def run_tracking(
    config: TrackingConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a tracking study in its folder, going on from a tuning's checkpoint if there is one.

    The task is built, and so the input checked, before the folder is touched.
    """
    task = build_task(config)
    trackers = {label: _checked(config, task, section, label) for label, section in config.trackers.items()}
    _check_path(config, task)
    tuning = None if config.tuning is None else build_tuning(config, task)
    folder, finished, begun = claim(config, out)
    if finished:
        return Run(folder, shared_summary(folder), already_finished=True)
    searched: Outcome | None = None
    with Stopwatch() as watch:
        if tuning is not None:
            wanted = config.tuning.optimizer
            for note in unused_keys([config], "tuning.optimizer"):
                say(note)
            phases = build_phases(wanted.kind, wanted.settings())
            with kept_search(
                folder, begun, phases, tuning, seed=config.seed, progress=config.output.progress, say=say
            ) as hooks:
                searched = run(phases, tuning, jax.random.key(config.seed), chunk=wanted.chunk, **hooks)
            if searched.interrupted:
                return Run(folder, None, interrupted=True)
            trackers[TUNED] = jax.device_get(tuning.tuned(np.asarray(searched.best_position)))
        paths = {label: track_task(config, task, tracker) for label, tracker in trackers.items()}
    if is_first():
        save_dataset(tracking_dataset(config, task, paths, searched), folder.result)
        write_json(folder.summary, tracking_summary(config, task, paths, searched, watch.as_dict()))
        folder.checkpoint.unlink(missing_ok=True)
    return Run(folder, shared_summary(folder))


def _checked(config: TrackingConfig, task: TrackingTask, section, label: str) -> Tracker:
    key = f"compare.{label}" if config.compare else "tracker"
    tracker = build_tracker(section)
    try:
        check_tracker(tracker)
        samples(float(task.target.duration), tracker.period)
        check_gains(tracker, tracker.period / tracker.substeps)
    except InputError as error:
        raise InputError(f"{config.where(key)}: {error}") from None
    return tracker


def _check_path(config: TrackingConfig, task: TrackingTask) -> None:
    """Refuse what no tracker can follow, before anything is tracked."""
    time = np.linspace(0.0, float(task.target.duration), _PATH_POINTS)
    points = np.asarray(jax.vmap(lambda t: task.target(t).position)(time))
    wrong = check_path(
        task.robot, time, points, task.initial_state, task.momentum, task.end_effector, task.base_mode
    )
    if wrong is not None:
        raise InputError(f"{config.where('path')}: {wrong.sentence}")
