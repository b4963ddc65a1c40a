"""Seeds draw other starts and leave the program as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_captures import planar_capture

from jffsr.capture import captures
from jffsr.capture.captures import CaptureSettings, CaptureTask, plan_captures


class EnoughError(Exception):
    """Raised in place of the search."""


def test_another_seed_is_the_same_program_for_other_starts(monkeypatch):
    problem, _ = planar_capture(20)
    path, asked = problem.constraints[0].path, []

    def record(batch, shared, *static):
        asked.append((shared[2], static))
        raise EnoughError

    monkeypatch.setattr(captures, "_candidates", record)
    settings = CaptureSettings(num_steps=20)
    for seed in (1, 2, 1):
        drawn = replace(settings, candidates=replace(settings.candidates, seed=seed))
        with pytest.raises(EnoughError):
            plan_captures(problem.robot, [CaptureTask(path, None)], problem.initial_state, drawn)
    (first, program), (second, other), (again, _) = asked
    assert program == other
    np.testing.assert_array_equal(first, again)
    assert np.all(first != second)
