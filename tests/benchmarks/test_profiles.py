"""Profiles and standings of runs that are small enough to be counted by hand."""

from __future__ import annotations

import numpy as np

from experiments.comparison.profiles import SearchRun, aims, performance_profiles, standings


def run(scenario: str, search: str, seed: int, *points: tuple[float, float]) -> SearchRun:
    charged, best = np.array(points).T
    return SearchRun(scenario, search, seed, charged, best)


RUNS = [
    run("a", "slow", 0, (10, 100.0), (200, 1.0), (400, 0.0)),
    run("a", "fast", 0, (10, 100.0), (50, 0.5), (60, 0.05)),
    run("a", "slow", 1, (10, 100.0), (100, 0.04)),
    run("a", "fast", 1, (10, 100.0), (400, 50.0)),
    run("b", "slow", 0, (10, 8.0), (20, 4.0)),
    run("b", "fast", 0, (10, 8.0), (20, 5.0)),
]


def test_solved_is_a_share_of_the_way_from_the_start_to_the_best():
    assert aims(RUNS, 0.01) == {"a": 1.0, "b": 4.04}
    assert aims(RUNS, 0.0) == {"a": 0.0, "b": 4.0}


def test_profiles_count_problems_within_a_factor_of_the_first():
    """To 1.0 on a: slow 200 and 100, fast 50 and never; to 4.04 on b: slow 20, fast never."""
    found = performance_profiles(RUNS, 0.01, np.array([1.0, 3.9, 4.0]))
    np.testing.assert_allclose(found["slow"], [2 / 3, 2 / 3, 1.0])
    np.testing.assert_allclose(found["fast"], [1 / 3, 1 / 3, 1 / 3])


def test_a_problem_that_no_one_solves_counts_for_no_one():
    never = [
        run("c", name, seed, (10, 9.0), (20, value)) for name in "xy" for seed, value in ((0, 1.0), (1, 6.0))
    ]
    found = performance_profiles(never, 1e-3, np.array([1.0, np.inf]))
    np.testing.assert_allclose(found["x"], [0.5, 0.5])


def test_wins_are_shared_by_those_who_cannot_be_told_apart():
    """On a with seed 0 the two end at 0 and 0.05, closer than a thousandth of the way from 100."""
    table = standings(RUNS)
    assert table["a"]["fast"].wins == 0.5
    assert table["a"]["slow"].wins == 1.5
    assert table["b"]["slow"].wins == 1.0
    assert table["a"]["fast"].median == np.median([0.05, 50.0])


def test_a_search_that_found_nothing_finite_wins_nothing():
    broken = [run("a", "broken", 0, (10, np.inf), (20, np.inf))]
    table = standings(RUNS + broken)
    assert table["a"]["broken"].wins == 0
    assert table["a"]["broken"].median == np.inf
    assert performance_profiles(RUNS + broken, 0.01, np.array([1.0, np.inf]))["broken"].max() == 0
