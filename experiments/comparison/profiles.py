"""What is made of the runs: who reaches how good a value first, and who ends best.

A problem is one scenario with one seed. It counts as solved where a search has gone down to
f <= f_best + tau (f_start - f_best), f_best being the best that any search found on that scenario with any seed,
f_start the median over the seeds of what the first generations found (More and Wild, "Benchmarking derivative-free
optimization algorithms", SIAM Journal on Optimization 20, 2009). The performance profile of a search at alpha is the
share of problems that it solves within alpha times the evaluations of the search that solves them first (Dolan and
More, Mathematical Programming 91, 2002).
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class SearchRun:
    """One search: charged (m,), evaluations charged so far, and best (m,), the best value by then, not rising."""

    scenario: str
    search: str
    seed: int
    charged: np.ndarray
    best: np.ndarray

    def charged_to(self, value: float) -> float:
        """Evaluations charged until the best is at most this; infinite if it never is."""
        reached = np.flatnonzero(self.best <= value)
        return float(self.charged[reached[0]]) if reached.size else np.inf

    @property
    def final(self) -> float:
        """The best value of all."""
        return float(self.best[-1])


def aims(runs: list[SearchRun], tau: float) -> dict[str, float]:
    """The value that counts as solved, for each scenario."""
    best, start = defaultdict(list), defaultdict(list)
    for run in runs:
        best[run.scenario].append(run.final)
        start[run.scenario].append(run.best[0])
    return {
        name: float(min(found) + tau * (_middle(start[name]) - min(found))) for name, found in best.items()
    }


def _middle(values: list[float]) -> float:
    finite = np.array(values)[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else np.inf


def performance_profiles(runs: list[SearchRun], tau: float, factors: np.ndarray) -> dict[str, np.ndarray]:
    """For each search the share of problems solved within these factors (m,) of the least evaluations."""
    aim = aims(runs, tau)
    needed: dict[str, dict[tuple[str, int], float]] = defaultdict(dict)
    for run in runs:
        needed[run.search][run.scenario, run.seed] = run.charged_to(aim[run.scenario])
    problems = sorted({problem for of_search in needed.values() for problem in of_search})
    least = {p: min(of_search.get(p, np.inf) for of_search in needed.values()) for p in problems}
    result = {}
    for search, of_search in needed.items():
        # A problem that no search solves is solved by none at any factor.
        ratio = np.array([_ratio(of_search.get(p, np.inf), least[p]) for p in problems])
        solved = np.isfinite(ratio)[:, None] & (ratio[:, None] <= factors[None])
        result[search] = np.mean(solved, axis=0)
    return result


def _ratio(needed: float, least: float) -> float:
    return needed / least if np.isfinite(needed) else np.inf


@dataclass(frozen=True)
class Standing:
    """How a search ends on one scenario: median and quartiles of its final values, and how many seeds it wins.

    A win is the least final value of all searches with that seed; equals within `_EQUAL` of the least share it.
    """

    median: float
    low: float
    high: float
    wins: float


_EQUAL = 1e-3


def standings(runs: list[SearchRun]) -> dict[str, dict[str, Standing]]:
    """Standings by scenario and search."""
    finals: dict[str, dict[str, dict[int, float]]] = defaultdict(lambda: defaultdict(dict))
    starts = aims(runs, 1.0)
    bests = aims(runs, 0.0)
    for run in runs:
        finals[run.scenario][run.search][run.seed] = run.final
    result = {}
    for scenario, by_search in finals.items():
        # What no one would tell apart is no win: a thousandth of the way from the start to the best.
        near = _EQUAL * (starts[scenario] - bests[scenario])
        wins: dict[str, float] = defaultdict(float)
        for seed in sorted({seed for values in by_search.values() for seed in values}):
            there = {search: values[seed] for search, values in by_search.items() if seed in values}
            winners = [search for search, value in there.items() if value <= min(there.values()) + near]
            for search in winners:
                wins[search] += 1 / len(winners)
        result[scenario] = {
            search: Standing(*_quartiles(list(values.values())), wins=wins[search])
            for search, values in by_search.items()
        }
    return result


def _quartiles(values: list[float]) -> tuple[float, float, float]:
    """Median, lower and upper quartile, of values that may be infinite."""
    # Between a number and infinity there is nothing to interpolate.
    method = "linear" if np.all(np.isfinite(values)) else "higher"
    median, low, high = np.quantile(values, (0.5, 0.25, 0.75), method=method)
    return float(median), float(low), float(high)
