"""The tracking benchmark's tables, and that what does not agree is never timed."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.benchmarks.tracking import _difference
from experiments.benchmarks.tracking_case import DURATION, TrackingCase
from experiments.benchmarks.tracking_tables import report

MACHINE = {
    "kind": "machine", "date": "2026-01-01", "processor": "a processor", "vectors": "AVX2", "cores": 2,
    "python": "3.12", "compiler": None, "versions": {"jax": "0.12", "pin": None},
}  # fmt: skip


def row(work, program, each, done, threads=1):
    return {
        "kind": "measurement", "work": work, "program": program, "threads": threads, "done": done,
        "median": each * done, "best": each * done, "samples": 3, "compile": 1.0, "difference": 0.0,
    }  # fmt: skip


def test_rates_and_ratios_are_those_of_the_rows():
    missing = {"kind": "measurement", "work": "tracking step", "program": "Pinocchio Python", "threads": 1}
    text = report(
        [
            MACHINE,
            {"kind": "load", "threads": 1, "load": 0.5},
            row("trackers", "jffsr", 5e-4, 1000),
            row("trackers", "jffsr, one at a time", 2e-3, 16),
            row("trackers", "jffsr", 2.5e-4, 1000, threads=2),
            row("tracking step", "jffsr", 4e-6, 1024),
            row("tracking step", "Pinocchio C++", 1e-5, 1024),
            row("tracking step", "jffsr", 1e-6, 1024, threads=2),
            missing | {"missing": "not installed"},
        ]
    )
    lines = text.splitlines()
    assert f"| 1 | jffsr, one call | 1000 | 0.5 | {DURATION / 5e-4:,.0f} | 4.0 | 1.0 | 0e+00 |" in lines
    assert f"| 2 | jffsr, one call | 1000 | 0.25 | {DURATION / 2.5e-4:,.0f} | 8.0 | 1.0 | 0e+00 |" in lines
    assert "| tracking step | 1 | Pinocchio C++ | 1024 | 10 | 2.50 | 1.0 | 0e+00 |" in lines
    assert "| tracking step | 2 | jffsr, one call | 1024 | 1 | 1.00 | 1.0 | 0e+00 |" in lines
    assert "* Pinocchio Python (tracking step): not installed" in lines
    assert "each process: 0.5." in text


def test_programs_that_do_not_agree_end_the_run():
    first = np.arange(12.0).reshape(4, 3)
    assert _difference(first[:2] + 1e-9, first) == pytest.approx(1e-9, rel=1e-6)
    for wrong in (first + 1e-6, np.where(first == 5, np.nan, first)):
        with pytest.raises(SystemExit, match="do not agree"):
            _difference(wrong, first)


def test_trackers_and_states_differ_from_each_other():
    case = TrackingCase(8, 8)
    for values in (*case.numbers.values(), *case.postures):
        assert values.shape[0] == 8
        assert len(np.unique(values.reshape(8, -1)[:, 0])) == 8
    np.testing.assert_allclose(np.linalg.norm(case.postures[1], axis=1), 1.0)
