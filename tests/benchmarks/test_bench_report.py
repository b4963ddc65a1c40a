"""The benchmark's report: targets are marked right, and nobody is left out in silence."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.benchmarks.checking import agrees, difference
from experiments.benchmarks.figure import draw
from experiments.benchmarks.jobs import groups
from experiments.benchmarks.opponents.registry import (
    FAST,
    KERNEL,
    OBVIOUS,
    OPPONENTS,
    PINOCCHIO,
    PLAIN,
    ROLLOUT,
    SHARED,
)
from experiments.benchmarks.tables import report
from experiments.benchmarks.targets import AT_LEAST, AT_MOST, FAILS, HOLDS, UNKNOWN, Target, targets

MACHINE = {
    "kind": "machine", "date": "2026-01-01", "processor": "a processor", "vectors": "AVX2", "cores": 2,
    "memory_gib": 8.0, "system": "Linux", "python": "3.12", "compiler": None, "versions": {"jax": "0.12", "pin": None},
}  # fmt: skip


def row(opponent, each, *, threads=1, done=None, axis="", work=ROLLOUT, **where):
    case = {"robot": "servicer_7dof", "batch": 1024, "steps": 200, "precision": "float64"} | where
    done = done or case["batch"]
    return {
        "kind": "measurement", "work": work, "axis": axis, "opponent": opponent, "threads": threads, "done": done,
        "median": each * done, "best": each * done, "compile": 1.0, "difference": 0.0, "samples": 3, **case,
    }  # fmt: skip


@pytest.fixture
def rows():
    device = {"kind": "device", "platform": "cpu", "device": "cpu", "devices": 1}
    return [
        MACHINE,
        device | {"threads": 1},
        device | {"threads": 2},
        row(FAST, 1e-4),
        row(FAST, 5e-5, threads=2),
        row(OBVIOUS, 3e-3),
        row(PLAIN, 2e-3),
        row(PINOCCHIO, 5e-4, done=100),
        row(KERNEL, 3e-5),
        row(FAST, 4e-5, axis="precision", precision="float32"),
        row(FAST, 2e-4, axis="batch", batch=1),
        row(PLAIN, 1e-4, axis="batch", batch=1),
        row("frax", 1.0) | {"missing": "not installed: no such module"},
        {"kind": "memory", "rollouts": 4096, "peak_bytes": 2**31},
    ]


def test_targets_are_marked_by_their_bounds():
    assert Target("t", 2.0, AT_LEAST, 2).verdict == HOLDS
    assert Target("t", 1.9, AT_LEAST, 2).verdict == FAILS
    assert Target("t", 2.0, AT_MOST, 2).verdict == HOLDS
    assert Target("t", 2.1, AT_MOST, 2).verdict == FAILS
    assert Target("t", float("nan"), AT_MOST, 2).verdict == FAILS
    assert Target("t", None, AT_LEAST, 2).verdict == UNKNOWN


def test_targets_are_ratios_of_the_times_of_one_rollout(rows):
    pinocchio, obvious, cores, single, gradient, kernel, one, memory = targets(rows)
    assert (pytest.approx(pinocchio.value), pinocchio.verdict) == (5, FAILS)
    # Of the two plain ways the faster one is the opponent.
    assert (pytest.approx(obvious.value), obvious.verdict) == (20, FAILS)
    assert (pytest.approx(cores.value), cores.verdict) == (2, HOLDS)
    assert (pytest.approx(single.value), single.verdict) == (2.5, HOLDS)
    assert (gradient.value, gradient.verdict) == (None, UNKNOWN)
    assert (pytest.approx(kernel.value), kernel.verdict) == (1e-4 / 3e-5, HOLDS)
    assert (pytest.approx(one.value), one.verdict) == (0.5, FAILS)
    assert "4,096" in memory.name
    assert (memory.value, memory.verdict) == (2.0, HOLDS)


def test_report_names_what_is_missing_and_draws(rows, tmp_path):
    text = report([x if "missing" not in x else {k: v for k, v in x.items() if k != "median"} for x in rows])
    assert "| frax | not installed: no such module |" in text
    assert text.count(f"| {FAILS} |") == 3
    assert "pin absent" in text
    draw(rows, tmp_path / "figure.png")
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_every_opponent_is_asked_for_a_rollout_and_a_base_twist():
    asked = {
        (job.work, name)
        for group in groups(all_cores=False, quick=True)
        for job in group
        for name in job.opponents
    }
    assert {name for work, name in asked if work == ROLLOUT} == set(OPPONENTS)
    assert {name for work, name in asked if work == "base twist"} == set(OPPONENTS) - {SHARED}
    for opponent in OPPONENTS.values():
        assert opponent.load().__doc__


def test_differences_know_the_two_signs_of_a_quaternion_and_what_is_no_number():
    q = np.array([[0.5, 0.5, 0.5, 0.5], [1.0, 0.0, 0.0, 0.0]])
    assert difference(-q[:1], q) == 0
    assert difference(q + np.array([0, 0, 0, 1e-3]), q) == pytest.approx(1e-3)
    assert agrees(1e-8, "float64", 200)
    assert not agrees(1e-5, "float64", 200)
    assert agrees(1e-5, "float64", 50)
    assert not agrees(float("nan"), "float32", 200)
