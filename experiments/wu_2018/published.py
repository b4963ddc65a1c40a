"""The published figures remade: methods, durations, momenta, the search for the damping pair, equal peak rates."""

from __future__ import annotations

from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from experiments.wu_2018.case import (
    ADAPTIVE,
    DURATIONS,
    EPSILON,
    GIVEN_MOMENTUM,
    METHODS,
    PERIOD,
    RATE_LIMIT_DEG,
    Case,
    follow,
    measure,
)
from jffsr.compiling import jit
from jffsr.optimizers.driver import run
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.tracking.indices import PublishedIndex, peak_rate, pose_errors, published_index
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track
from jffsr.tracking.tuning import tuning

MEMBERS, GENERATIONS = 40, 40
BOUNDS = {"lambda_max": (0.005, 0.3), "epsilon": (0.01, 0.3)}
MOMENTA = {"zero": np.zeros(6), "given": GIVEN_MOMENTUM}
_GENES = {
    "bits": 20,
    "selection": "tournament",
    "crossover_rate": 0.8,
    "mutation_rate": 0.01,
    "elitism": True,
}


def published_runs(case: Case) -> dict[tuple[float, str, str], tuple[Any, Any]]:
    """Tracked motion and what is measured of it, by duration, momentum and method."""
    found = {}
    for duration in DURATIONS:
        target = case.target(duration)
        for momentum, value in MOMENTA.items():
            for method, tracker in METHODS.items():
                tracked = follow(case, target, tracker, momentum=value)
                found[duration, momentum, method] = tracked, measure(case, target, tracked)
    return found


def zero_of_determinant(tracked: Any) -> float | None:
    """When, s, the determinant first changes its sign; None where it does not."""
    value, time = np.asarray(tracked.determinant), np.asarray(tracked.time)
    places = np.flatnonzero(value[:-1] * value[1:] < 0)
    if not places.size:
        return None
    k = places[0]
    return float(time[k] + (time[k + 1] - time[k]) * value[k] / (value[k] - value[k + 1]))


def rate_limit(tracked: Any) -> float:
    """The limit that the search is given, deg/s: 6, or 1.05 times the peak away from the singularity if larger."""
    away = np.asarray(tracked.singular_values)[:, -1] > EPSILON
    rates = np.rad2deg(np.abs(np.asarray(tracked.motion.joint_velocity)))
    return max(RATE_LIMIT_DEG, 1.05 * float(rates[away].max()))


def search(case: Case, duration: float, limit_deg: float, seed: int = 0) -> dict[str, Any]:
    """The paper's genetic algorithm for (lambda_max, epsilon): the pair found, and each generation's best and mean."""
    target, limit = case.target(duration), np.deg2rad(limit_deg)
    problem = tuning(case.robot, target, case.start(), ADAPTIVE, PublishedIndex(limit), BOUNDS)
    settings = Settings(particles=MEMBERS, evaluations=MEMBERS * GENERATIONS, options=_GENES)
    best, mean, broken = [], [], []

    def look(snapshot: Any) -> None:
        values = np.asarray(snapshot.state.kept_value)
        best.append(float(snapshot.state.progress.best_value))
        mean.append(float(values.mean()))
        # Any overrun above a thousandth of the limit is worse than the largest B.
        broken.append(int(np.sum(values > 0.02)))

    outcome = run(build_phases("ga_binary", settings), problem, jax.random.key(seed), chunk=1, on_chunk=look)
    pair = problem.tuned(jnp.asarray(outcome.best_position))
    tracker = Tracker(float(pair.lambda_max), float(pair.epsilon), limits="ignore")
    tracked = follow(case, target, tracker)
    return {
        "limit": limit_deg,
        "lambda_max": tracker.lambda_max,
        "epsilon": tracker.epsilon,
        "best": best,
        "mean": mean,
        "broken": broken,
        "tracked": tracked,
        "measured": measure(case, target, tracked),
    }


@partial(jit, static_argnames="samples")
def scanned(robot, target, start, trackers, samples):
    """Peak rate, rad/s, B, largest position error, m, and attitude error, rad, at the samples, of many trackers."""

    def one(tracker):
        tracked = track(robot, target, start, tracker, num_samples=samples)
        errors = pose_errors(tracked)
        return peak_rate(tracked), published_index(tracked), errors.position_peak, errors.attitude_peak

    return jax.lax.map(one, trackers, batch_size=128)


def scan(case: Case, duration: float, trackers: Tracker) -> np.ndarray:
    """Rows of peak, deg/s, B, position error, mm, and attitude error, deg, (4, m)."""
    target = case.target(duration)
    found = scanned(case.robot, target, case.start(), trackers, round(duration / PERIOD))
    return np.stack([np.asarray(x) for x in found]) * np.array([180 / np.pi, 1, 1e3, 180 / np.pi])[:, None]


def grid_of_pairs(side: int = 36) -> Tracker:
    """Adaptive trackers over a logarithmic grid of both numbers."""
    pairs = np.stack(np.meshgrid(np.geomspace(0.01, 0.4, side), np.geomspace(0.01, 0.4, side)), -1).reshape(
        -1, 2
    )
    return _many(pairs[:, 0], pairs[:, 1])


def _many(lambda_max: np.ndarray, epsilon: np.ndarray, gain: np.ndarray | None = None) -> Tracker:
    """Adaptive trackers of arrays (m,) of numbers; with gains, 1/s, they feed the error back."""
    full = np.ones_like(lambda_max)
    gain = 0 * full if gain is None else gain
    return Tracker(
        lambda_max=lambda_max,
        epsilon=epsilon,
        damping=0 * full,
        threshold=full,
        position_gain=gain,
        attitude_gain=gain,
        feedforward="mean",
        limits="ignore",
    )


def with_feedback(count: int = 1500, seed: int = 0) -> Tracker:
    """Adaptive trackers that feed the error back, their numbers and gains drawn evenly in logarithms."""
    draw = np.random.default_rng(seed).uniform
    lambda_max, epsilon, gain = (
        np.exp(draw(*np.log(bounds), count)) for bounds in ((0.01, 0.6), (0.01, 0.8), (0.01, 2.0))
    )
    return _many(lambda_max, epsilon, gain)


def pick(trackers: Tracker, index: int) -> Tracker:
    """One of many trackers."""
    return jax.tree.map(lambda x: float(x[index]), trackers)


def damped_at_peak(case: Case, duration: float, peak: float) -> Tracker:
    """The plain damped tracker whose largest rate is `peak`, deg/s: least damping that keeps it, by bisection."""
    low, high = np.log(1e-3), np.log(0.5)
    target = case.target(duration)

    def tracker(logarithm: float) -> Tracker:
        return Tracker(method="damped", damping=float(np.exp(logarithm)), limits="ignore")

    for _ in range(24):
        middle = 0.5 * (low + high)
        reached = np.rad2deg(float(peak_rate(follow(case, target, tracker(middle)))))
        low, high = (middle, high) if reached > peak else (low, middle)
    return tracker(high)
