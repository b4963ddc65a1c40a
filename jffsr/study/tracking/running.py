"""A tracking study: every tracker on the path, verified; before that, where asked for, the search for its numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import jax
import numpy as np

from jffsr.compiling import program
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
from jffsr.tracking.indices import PoseErrors, peak_rate, pose_errors, published_index
from jffsr.tracking.limits import IGNORE
from jffsr.tracking.outcome import TrackingCode, TrackingResult, TrackingTolerances, check_path, outcome
from jffsr.tracking.singularity.along import singularities
from jffsr.tracking.singularity.report import SingularityReport
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracker import Tracker, check_gains, check_tracker
from jffsr.tracking.tracking import samples, track
from jffsr.tracking.verification import LEAST_STEPS, TrackingVerification, verify_tracking
from jffsr.types import Scalar

TUNED = "tuned"
_PATH_POINTS = 201


@dataclass(frozen=True)
class TrackedPath:
    """One tracker's motion and what is said of it: on the host."""

    tracker: Tracker
    tracked: Tracked
    verification: TrackingVerification
    errors: PoseErrors
    published: Scalar
    peak_rate: Scalar
    result: TrackingResult
    singularities: SingularityReport | None


@program(static_argnums=(3, 4, 5), once=True)
def _tracked(arrays, tracker: Tracker, duration, num_samples: int, end_effector: str, base_mode: str):
    robot, target, state, momentum = arrays
    return track(robot, target, state, tracker, duration, momentum, end_effector, base_mode, num_samples)


# Apart from the tracking, so that it is compiled once for all methods.
@program(static_argnums=(2, 3), once=True)
def _reviewed(robot, tracked: Tracked, end_effector: str, num_steps: int):
    verification = verify_tracking(robot, tracked, end_effector, num_steps)
    return verification, pose_errors(tracked), published_index(tracked), peak_rate(tracked)


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


def track_task(config: TrackingConfig, task: TrackingTask, tracker: Tracker) -> TrackedPath:
    """A task's path followed by one tracker, verified and judged."""
    steps = max(LEAST_STEPS, config.verification.step_factor * tracker.integration_steps)
    duration = float(task.target.duration)
    tracked = jax.device_get(
        _tracked(
            (task.robot, task.target, task.initial_state, task.momentum),
            tracker,
            duration,
            samples(duration, tracker.period),
            task.end_effector,
            task.base_mode,
        )
    )
    found = jax.device_get(_reviewed(task.robot, tracked, task.end_effector, steps))
    verification, errors, published, peak = found
    result = _within_rate(
        config,
        peak,
        outcome(task.robot, tracked, verification, tolerances(config, tracker), task.end_effector),
    )
    report = None
    if config.verification.singularities and np.all(np.isfinite(tracked.motion.joint_position)):
        report = singularities(task.robot, tracked, task.end_effector)
    return TrackedPath(tracker, tracked, verification, errors, published, peak, result, report)


def tolerances(config: TrackingConfig, tracker: Tracker) -> TrackingTolerances:
    """What a path has to keep: the accuracy asked for, and the limits where they are not ignored."""
    position, attitude = config.accuracy.position, config.accuracy.si("attitude")
    return TrackingTolerances(
        position=np.inf if position is None else position,
        attitude=np.inf if attitude is None else attitude,
        limit=np.inf if tracker.limits == IGNORE else TrackingTolerances.limit,
    )


def _within_rate(config: TrackingConfig, peak: Scalar, result: TrackingResult) -> TrackingResult:
    """The result, but for a path that is kept with a larger joint rate than the accuracy asks for."""
    asked = config.accuracy.si("rate")
    if not result.success or asked is None or peak <= asked:
        return result
    return TrackingResult(
        TrackingCode.LIMITS_EXCEEDED,
        f"the largest joint rate is {np.rad2deg(peak):.4g} deg/s, accuracy.{config.accuracy.key_of('rate')} asks for "
        f"{np.rad2deg(asked):.4g} deg/s; {result.sentence}",
    )


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
