"""What each freedom gains at the published duration and peak rate: law, feedback, timing, rates, roll, posture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from experiments.wu_2018.case import (
    ADAPTIVE,
    PERIOD,
    POSTURES_DEG,
    Case,
    Measured,
    follow,
    inside_share,
    measure,
)
from experiments.wu_2018.published import grid_of_pairs, pick, scan, with_feedback
from jffsr.compiling import jit
from jffsr.tracking.refinement import refine_tracking
from jffsr.tracking.retimed import Retimed
from jffsr.tracking.tool_task import ROLL_FREE
from jffsr.tracking.tracker import MEAN, Tracker
from jffsr.tracking.tracking import track, track_rates
from jffsr.tracking.verification import verify_tracking
from jffsr.trajectories.cartesian.fastest import fastest_timing, rate_bound
from jffsr.trajectories.cartesian.timing import Uniform
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory

FEEDBACK = Tracker(
    ADAPTIVE.lambda_max,
    ADAPTIVE.epsilon,
    position_gain=1.0,
    attitude_gain=1.0,
    feedforward=MEAN,
    limits="ignore",
)
ELBOW, WRIST = "other elbow", "wrist turned over"
_FINE = 12000
_PLACES = 1200


@dataclass(frozen=True)
class Gained:
    """A motion, what it tracks, and what is measured of it; in words, what was free and how it was used; inside, the
    share of samples at which the arm leads through the drawn base."""

    freedom: str
    how: str
    tracked: Any
    target: Any
    measured: Measured
    verification: Any = None
    inside: float = 0.0


def refined(case: Case, of: Gained, peak: float, iterations: int, **options: Any) -> Gained:
    """The motion refined at a peak rate, deg/s; errors are weighed as the published method's largest ones."""
    found = refine_tracking(
        case.robot,
        of.target,
        of.tracked,
        rate_limit=np.deg2rad(peak),
        iterations=iterations,
        **{"position_scale": 0.009, "attitude_scale": np.deg2rad(1.8), **options},
    )
    measured = measure(case, found.target, found.tracked, options.get("freedom", "all"))
    return Gained(of.freedom, of.how, found.tracked, found.target, measured)


def tracked_with(
    case: Case, duration: float, tracker: Tracker, posture: str, freedom: str, how: str
) -> Gained:
    """The trapezoid's path tracked from a posture."""
    target = case.target(duration)
    tracked = follow(case, target, tracker, case.start(posture))
    return Gained(freedom, how, tracked, target, measure(case, target, tracked))


def best_of(case: Case, duration: float, peak: float, trackers: Tracker, scanned: np.ndarray) -> Tracker:
    """Of scanned trackers the one with the least errors among those that keep the peak."""
    worst = np.maximum(scanned[2] / 9.0, scanned[3] / 1.8)
    return pick(trackers, int(np.argmin(np.where(scanned[0] <= peak, worst, np.inf))))


@jit
def _by_place(robot, line, start, tracker):
    """Joints (_FINE + 1, n) of the way at an even pace: at zero momentum they depend on the place alone."""
    target = ToolTrajectory(line, Uniform(np.array(1.0)))
    return track(robot, target, start, tracker, num_samples=_FINE).motion.joint_position


def _pace(case: Case, joints: np.ndarray, peak: float):
    """The fastest timing of joints by place under a peak rate, deg/s; between two places no slope is overlooked."""
    slopes = np.abs(np.diff(joints, axis=0)) * _FINE
    slopes = slopes.reshape(-1, _FINE // _PLACES, joints.shape[1]).max(axis=1)
    edges = np.concatenate([slopes[:1], np.maximum(slopes[1:], slopes[:-1]), slopes[-1:]])
    limits = np.full(joints.shape[1], np.deg2rad(peak))
    places = np.linspace(0, 1, len(edges))
    bound = np.asarray(rate_bound(jnp.asarray(edges), limits))
    return fastest_timing(places, bound, start_rate=float(bound[0]), end_rate=float(bound[-1]))


def slowed(case: Case, duration: float, peak: float) -> Gained:
    """The published law at the pace that evens its rates out, with the damping whose error is least within the peak."""
    found, start = [], case.start()
    for share in np.geomspace(0.3, 2.0, 9):
        pair = share * ADAPTIVE.lambda_max, share * ADAPTIVE.epsilon
        fine = Tracker(*pair, period=1 / _FINE, limits="ignore")
        timing = _pace(case, np.asarray(_by_place(case.robot, case.line, start, fine)), peak)
        target = ToolTrajectory(case.line, timing.to_last(jnp.asarray(duration)))
        tracked = follow(case, target, Tracker(*pair, limits="ignore"))
        how = f"published law at {share:.2f} of its damping, at the pace that evens its rates out"
        found.append(Gained("timing", how, tracked, target, measure(case, target, tracked)))
    kept = [row for row in found if row.measured.peak <= peak]
    if kept:
        return min(kept, key=lambda row: row.measured.attitude)
    return min(found, key=lambda row: row.measured.peak)


def exact_way(case: Case, posture: str = "published") -> np.ndarray:
    """Joints by place of the exact path, by steps so fine that nothing need be damped."""
    exact = Tracker(
        method="inverse",
        limits="ignore",
        feedforward=MEAN,
        period=1 / _FINE,
        position_gain=0.5 * _FINE,
        attitude_gain=0.5 * _FINE,
    )
    return np.asarray(_by_place(case.robot, case.line, case.start(posture), exact))


def time_needed(joints: np.ndarray, peak: float) -> float:
    """The least duration, s, of a way through joints by place at a peak rate, deg/s."""
    return float(np.rad2deg(np.abs(np.diff(joints, axis=0)).max(axis=1)).sum() / peak)


def exact_in_time(case: Case, joints: np.ndarray, duration: float, peak: float) -> Gained:
    """The exact way in a duration, s, its rates evened out so that their peak is the least, then cut at the peak."""
    spent = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(joints, axis=0)).max(axis=1))])
    samples = round(duration / PERIOD)
    places = np.interp(np.linspace(0, spent[-1], samples + 1), spent, np.linspace(0, 1, _FINE + 1))
    at = np.stack([np.interp(places, np.linspace(0, 1, _FINE + 1), q) for q in joints.T], axis=1)
    rates = np.clip(np.diff(at, axis=0) / PERIOD, -np.deg2rad(peak), np.deg2rad(peak))
    target = Retimed(
        ToolTrajectory(case.line, Uniform(jnp.asarray(1.0))), jnp.asarray(places), jnp.asarray(duration)
    )
    tracked = _rates(case.robot, target, case.start(), rates, duration)
    return Gained("", "", tracked, target, measure(case, target, tracked))


_rates = jit(track_rates)


def freedoms(case: Case, duration: float, reference: Measured, every: bool = True) -> list[Gained]:
    """All freedoms one by one and together, at the peak rate of the published method's motion."""
    peak = reference.peak
    published = tracked_with(case, duration, ADAPTIVE, "published", "none", "published method")
    rows = [published]
    if every:
        pairs, fed = grid_of_pairs(), with_feedback()
        law = best_of(case, duration, peak, pairs, scan(case, duration, pairs))
        how = f"best damping pair of {len(pairs.lambda_max)}: {law.lambda_max:.3g}, {law.epsilon:.3g}"
        rows.append(tracked_with(case, duration, law, "published", "law", how))
        back = best_of(case, duration, peak, fed, scan(case, duration, fed))
        how = (
            f"best of {len(fed.lambda_max)} draws: pair {back.lambda_max:.3g}, {back.epsilon:.3g}, gain "
            f"{back.position_gain:.2g} 1/s"
        )
        rows.append(tracked_with(case, duration, back, "published", "feedback", how))
        rows.append(slowed(case, duration, peak))
    fast = tracked_with(case, duration, FEEDBACK, "published", "rates", "")
    rates = min(
        (refined(case, of, peak, 20) for of in (published, fast)),
        key=lambda found: found.measured.over(reference),
    )
    rows.append(_named(rates, "rates", "every held rate refined"))
    if every:
        both = refined(case, rates, peak, 12, retime=True)
        rows.append(_named(both, "rates and timing", "every held rate and the pace refined"))
        roll = refined(case, rates, peak, 12, freedom=ROLL_FREE)
        rows.append(
            _named(
                roll, "rates and relaxed roll", "every held rate refined; roll about the tool's z not counted"
            )
        )
    rows.append(turned_over(case, duration, peak, reference))
    rows.append(
        tracked_with(case, duration, ADAPTIVE, ELBOW, "posture", "published method from the other elbow")
    )
    how = "the same, the error fed back (1/s)"
    fed_back = tracked_with(case, duration, FEEDBACK, ELBOW, "posture and feedback", how)
    rows.append(fed_back)
    rows.append(
        _named(
            refined(case, fed_back, peak, 12),
            "posture, feedback and rates",
            "the same, every held rate refined",
        )
    )
    return [_verified(case, row) for row in rows]


def turned_over(case: Case, duration: float, peak: float, reference: Measured) -> Gained:
    """The same arm with its forearm and wrist turned over, every held rate refined from the better of two starts."""
    starts = (tracked_with(case, duration, tracker, WRIST, "", "") for tracker in (ADAPTIVE, FEEDBACK))
    best = min((refined(case, of, peak, 20) for of in starts), key=lambda of: of.measured.over(reference))
    return _named(
        best, "wrist turned over, and rates", "forearm and wrist turned over, every held rate refined"
    )


def _named(found: Gained, freedom: str, how: str) -> Gained:
    return Gained(freedom, how, found.tracked, found.target, found.measured)


_verify = jit(verify_tracking)


def _verified(case: Case, row: Gained) -> Gained:
    verification = jax.tree.map(np.asarray, _verify(case.robot, row.tracked))
    return Gained(
        row.freedom,
        row.how,
        row.tracked,
        row.target,
        row.measured,
        verification,
        inside_share(case, row.tracked),
    )


def postures(case: Case, duration: float) -> dict[str, Measured]:
    """The published method from every posture."""
    return {name: tracked_with(case, duration, ADAPTIVE, name, "", "").measured for name in POSTURES_DEG}
