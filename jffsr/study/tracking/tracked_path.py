"""One tracker on a study's path: its motion, verified and judged."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np

from jffsr.compiling import program
from jffsr.study.tracking.building import TrackingTask
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.tracking.indices import PoseErrors, peak_rate, pose_errors, published_index
from jffsr.tracking.limits import IGNORE
from jffsr.tracking.outcome import TrackingCode, TrackingResult, TrackingTolerances, outcome
from jffsr.tracking.singularity.along import singularities
from jffsr.tracking.singularity.report import SingularityReport
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import samples, track
from jffsr.tracking.verification import LEAST_STEPS, TrackingVerification, verify_tracking
from jffsr.types import Scalar


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
