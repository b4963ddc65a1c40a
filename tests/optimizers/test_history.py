"""A long search's history: bounded, the same however it is cut, and true in what is read from it."""

from __future__ import annotations

import random
from dataclasses import replace

import jax
import numpy as np
import pytest
from shifted_functions import LOWER, UPPER, sphere

from jffsr.optimizers import history
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.history import Record, add, before_last_tenth
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.qpso import QPSO
from jffsr.planning.result import settled, stands_still


def records(count: int, seed: int, share: float, phases: int = 3, factor: float = 0.9999) -> list[Record]:
    """Phases of `count` iterations each; in this share of them the value becomes better."""
    rng = random.Random(seed)
    found, best = [], 100.0
    for phase in range(phases):
        for iteration in range(1, count + 1):
            best *= factor if rng.random() < share else 1.0
            done = phase * count + iteration
            found.append(Record(phase, iteration, 10 * done, phase * iteration, best))
    return found


def thinned(whole: list[Record]) -> list[Record]:
    kept = []
    for record in whole:
        add(kept, record)
    return kept


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 1.0])
def test_long_history_is_bounded_and_keeps_the_ends(share):
    whole = records(30_000, 1, share)
    kept = thinned(whole)
    assert len(kept) <= history.LIMIT
    assert kept[-1] == whole[-1]
    for phase in range(3):
        own = [record for record in whole if record.phase == phase]
        assert {own[0], own[-1]} <= set(kept)
    assert kept == sorted(kept, key=lambda record: record.evaluations)


def test_short_history_is_whole():
    whole = records(1000, 2, 0.5)
    assert thinned(whole) == whole


def test_first_time_below_a_value_is_exact_while_improvements_are_few():
    whole = records(30_000, 3, 0.01, factor=0.99)
    kept = thinned(whole)
    for value in np.geomspace(whole[-1].best_value, 99.0, 50):
        exact = next(record for record in whole if record.best_value <= value)
        assert next(record for record in kept if record.best_value <= value) == exact


def test_first_time_below_a_value_is_near_where_they_are_many():
    whole = records(30_000, 4, 1.0)
    kept = thinned(whole)
    for value in np.geomspace(whole[-1].best_value, 99.0, 50):
        exact = next(record for record in whole if record.best_value <= value)
        found = next(record for record in kept if record.best_value <= value)
        assert 0 <= found.evaluations - exact.evaluations <= 0.002 * whole[-1].evaluations


@pytest.mark.parametrize("count", [1, 2, 7, 400, 5000])
def test_whether_a_search_stands_still_is_as_from_every_record(count):
    answers = set()
    for seed in range(8):
        whole = records(count, seed, 3 / count, phases=2, factor=0.9)
        expected = bool(settled(np.array([record.best_value for record in whole])))
        earlier = before_last_tenth(thinned(whole))
        assert bool(stands_still(earlier, whole[-1].best_value)) == expected
        answers.add(expected)
    assert len(answers) == 2 or count < 400


def test_before_the_last_tenth_of_nothing():
    assert before_last_tenth([]) is None
    assert before_last_tenth([Record(0, 1, 10, 0, 3.0)]) is None


def test_chunks_and_resuming_do_not_change_it(monkeypatch):
    monkeypatch.setattr(history, "LIMIT", 16)
    problem = FunctionProblem(LOWER[:2], UPPER[:2], sphere)
    phases = [Phase("swarm", QPSO(150.0, particles=5), Stop(iterations=150.0))]
    snapshots = []
    outcome = run(phases, problem, jax.random.key(1), chunk=20, on_chunk=snapshots.append)
    assert len(outcome.history) <= 16
    assert (outcome.evaluations, outcome.history[-1].iteration) == (750, 150)
    assert max(len(snapshot.history) for snapshot in snapshots) <= 16
    assert run(phases, problem, jax.random.key(1), chunk=7).history == outcome.history
    middle = replace(snapshots[3])
    assert run(phases, problem, jax.random.key(1), chunk=20, resume=middle).history == outcome.history
