"""What the page of the capture solvers counts, from lines written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.captures.solvers import problem_of, tables
from experiments.captures.work import write_line


def line(number: int, errors: list[float], kept: bool, **more) -> dict:
    """A line with all errors inside the tolerance where none is above 0.01."""
    within = max(errors) <= 0.01
    base = {"number": number, "seconds": 0.5, "errors": errors, "within": within, "kept": kept}
    return {**base, "disturbance": 0.1 * (1 + number), "manipulability": 2.0 + number, **more}


def test_a_capture_counts_where_it_matches_and_keeps_the_rest(tmp_path):
    rows = [([1e-5] * 4, True), ([5e-3] * 4, True), ([1e-5] * 4, False), ([0.2] * 4, True)]
    for number, (errors, kept) in enumerate(rows):
        write_line(
            tmp_path / "published.jsonl", line(number, errors, kept, match=float(number), stored=number % 2)
        )
    text = tables(tmp_path)
    row = next(x for x in text.splitlines() if x.startswith("| published"))
    assert row.split("|")[2:6] == [" 4 ", " 3 ", " 2 ", " 1 "]
    assert "2.5e-03, 2.0e-01" in row
    assert row.endswith("| 0.50 |")
    # Of the two that count: 0.1 and 0.2, 2 and 3.
    assert "| 2 | 0.1500 | 2.500 |" in text
    assert "is 1.50 in the median" in text
    assert "left in 2." in text


def test_captures_are_posed_as_the_planner_poses_them():
    """Same bounds, constraints and margins as the problems of `plan_captures`."""
    from experiments.captures.sampling import draw, initial_state, model_of, motion_of, robot
    from experiments.captures.work import SETTINGS
    from jffsr.capture import captures
    from jffsr.capture.captures import CaptureTask
    from jffsr.capture.grasp_path import GraspPath
    from jffsr.robots.stacking import first_unlike

    sample = draw(1, 0)
    task = CaptureTask(GraspPath.create(motion_of(sample)), model_of(sample))
    window = SETTINGS.candidates.window
    theirs = captures._problem(robot(), initial_state(), SETTINGS, task, 20.0, None, None, "floating")
    ours = problem_of(task, 20.0, window=window)
    assert first_unlike([theirs, ours]) is None
    for a, b in zip(theirs.bounds(), ours.bounds(), strict=True):
        np.testing.assert_array_equal(a, b)
    for a, b in zip(theirs.constraints, ours.constraints, strict=True):
        assert a.name == b.name
        assert np.all(np.asarray(a.tolerance) == np.asarray(b.tolerance))
    margins = [p.constraints[-1].keep.margin for p in (theirs, ours)]
    assert margins[0] == pytest.approx(margins[1], rel=1e-15)
