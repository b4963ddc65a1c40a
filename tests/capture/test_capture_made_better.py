"""What `plan_capture` does once a capture is found: its index less, verified, on a finer grid."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from planar_captures import planar_capture

import jffsr
from jffsr.capture import plan as planner
from jffsr.capture.captures import CaptureSettings
from jffsr.capture.outcome import CaptureCode, CaptureResult

pytestmark = pytest.mark.slow


def test_a_capture_that_was_found_is_made_better(monkeypatch):
    problem, free = planar_capture(48)
    result = CaptureResult(CaptureCode.CAPTURED, "captured")
    found = SimpleNamespace(
        problems=[problem],
        free=free[None],
        attempts=np.ones(1, int),
        jacobians=np.full(1, 5),
        result=lambda number: result,
    )
    monkeypatch.setattr(planner, "plan_captures", lambda *args, **keywords: found)
    path, settings = problem.constraints[0].path, CaptureSettings(num_steps=48)
    plan = jffsr.plan_capture(problem.robot, path, problem.initial_state, None, settings)
    assert plan.result.success
    assert plan.problem.num_steps == 2 * 48
    # What was spent on the way to the first plan counts.
    assert plan.jacobians > 5
    # The base is displaced by what the arm's end leaves open, and turned by the way: 0.1648 as the arm went first.
    np.testing.assert_allclose(plan.before, 0.16479, atol=1e-5)
    # A valley with a floor near by; the captures of the benchmark halve it.
    assert plan.cost < 0.98 * plan.before
    assert np.max(np.abs(plan.error)) < 1e-6
    half = np.linalg.norm(plan.motion.base_quaternion[-1][1:])
    moved = np.linalg.norm(plan.motion.base_position[-1] - plan.motion.base_position[0])
    np.testing.assert_allclose(plan.cost, np.hypot(moved, half), rtol=1e-9)
    rates = np.abs(plan.motion.joint_velocity) / problem.robot.limits.velocity
    assert rates.max() <= 1.0
