"""The Pareto set of captures: verified, none dominated, ends at the ends, and no random capture beats it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from planar_captures import planar_capture

from jffsr.capture.batch import restore_many
from jffsr.capture.captures import CaptureSettings
from jffsr.capture.front import CaptureFront, WeightedTerms, _apart, capture_front
from jffsr.capture.outcome import CaptureCode, CaptureResult
from jffsr.capture.plan import CapturePlan, verified_plans
from jffsr.capture.terms import BaseDisturbance, LostManipulability
from jffsr.errors import InputError
from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.smoothing import Smoothing
from jffsr.target.grasp_frames import grasp_frame

STEPS = 48
LANES = 4
SETTINGS = CaptureSettings(num_steps=STEPS // 2)


@pytest.fixture(scope="module")
def plan():
    problem, free = planar_capture(STEPS)
    path = problem.constraints[0].path
    pair = (BaseDisturbance(np.asarray(1.0)), LostManipulability(path, np.asarray(1.0)))
    told = replace(problem, objective=CompositeIndex(pair, accuracy=np.asarray(np.inf)))
    return verified_plans([told] * LANES, np.tile(free, (LANES, 1)), SETTINGS)[0]


@pytest.fixture(scope="module")
def front(plan) -> CaptureFront:
    return capture_front(plan, levels=LANES, settings=SETTINGS)


@pytest.mark.slow
def test_members_are_verified_and_none_is_better_in_both(plan, front):
    assert plan.result.success
    assert all(member.result.success for member in front.plans)
    assert all(np.max(np.abs(member.error)) < 1e-6 for member in front.plans)
    assert front.names == ("base_disturbance", "manipulability")
    assert len(front) >= 5
    # One falls, or the other rises: by the first index, the second grows with it.
    assert np.all(np.diff(front.values[:, 0]) > 0)
    assert np.all(np.diff(front.values[:, 1]) > 0)
    # Values are those of the motions, by plain arithmetic.
    for member, (disturbance, measure) in zip(front.plans, front.values, strict=True):
        moved = member.motion.base_position[-1] - member.motion.base_position[0]
        half = np.linalg.norm(member.motion.base_quaternion[-1][1:])
        np.testing.assert_allclose(disturbance, np.hypot(np.linalg.norm(moved), half), rtol=1e-9)
        assert measure == -member.terms["lost_manipulability"].value


@pytest.mark.slow
def test_the_tool_is_at_the_handle_in_each(front):
    for member in front.plans:
        path, end = member.problem.constraints[0].path, member.motion
        handle, _, _ = jax.device_get(grasp_frame(path.motion.target, path.motion(20.0)))
        # Along the chain by hand: 0.5 m to the first joint, then three links of 1 m.
        yaw = 2 * np.arctan2(end.base_quaternion[-1, 3], end.base_quaternion[-1, 0])
        angles = yaw + np.cumsum(end.joint_position[-1])
        tip = end.base_position[-1, :2] + 0.5 * np.array([np.cos(yaw), np.sin(yaw)])
        tip += np.sum([np.cos(angles), np.sin(angles)], axis=1)
        np.testing.assert_allclose(tip, handle[:2], atol=1e-6)


@pytest.mark.slow
def test_the_ends_are_the_best_in_their_own_index_and_better_than_the_plan(plan, front):
    least, most = (front.chosen[f"least_{name}"] for name in ("base_disturbance", "lost_manipulability"))
    assert (least, most) == (0, len(front) - 1)
    assert front.values[0, 0] < 0.9 * plan.terms["base_disturbance"].value
    assert front.values[-1, 1] > -1.1 * plan.terms["lost_manipulability"].value
    scaled = (front.values - front.values.min(axis=0)) / np.ptp(front.values, axis=0)
    far = np.hypot(scaled[:, 0], 1 - scaled[:, 1])
    assert front.chosen["balanced"] == np.argmin(far)


@pytest.mark.slow
def test_other_captures_join_the_set(plan, front):
    """Begun from the ends of a set, the next one is no worse there; what keeps no constraint does not enter."""
    ends = np.stack([front.plans[0].free, front.plans[-1].free, plan.free + 0.3])
    again = capture_front(plan, levels=LANES, settings=SETTINGS, others=ends)
    assert all(member.result.success for member in again.plans)
    assert again.values[0, 0] <= front.values[0, 0] + 1e-9
    assert again.values[-1, 1] >= front.values[-1, 1] - 1e-9


@pytest.mark.slow
def test_no_random_capture_about_the_plan_beats_the_set(plan, front):
    """Points all about the plan's, brought to where the constraints are kept by other code than the descents."""
    rng = np.random.default_rng(5)
    starts = plan.free + rng.uniform(-0.4, 0.4, (120, plan.free.size))
    low, high = plan.problem.bounds()
    found = restore_many([plan.problem] * 120, np.clip(starts, low, high)[:, None])
    assert found.kept.sum() >= 30
    values = [
        [term.value for term in jax.device_get(told).values()] for told in map(_terms(plan), found.free)
    ]
    values = np.array(values)[found.kept] * [1.0, -1.0]
    better = (values[:, None, 0] < front.values[None, :, 0] - 1e-3) & (
        values[:, None, 1] > front.values[None, :, 1] + 1e-3
    )
    assert not np.any(better)


def _terms(plan):
    return jax.jit(plan.problem.terms)


def test_weights_choose_among_terms():
    class Plain:
        def __init__(self, number, scale):
            self.number, self.scale = number, scale

        def value(self, robot, motion):
            return self.number

        def smooth(self, robot, motion, smoothing):
            return 2 * self.number

    term = WeightedTerms((Plain(3.0, 2.0), Plain(5.0, 0.5)), np.array([0.0, 1.0]))
    assert float(term.value(None, None)) == 10.0
    assert float(term.smooth(None, None, Smoothing())) == 20.0
    mixed = WeightedTerms((Plain(3.0, 2.0), Plain(5.0, 0.5)), np.array([2.0, 0.1]))
    np.testing.assert_allclose(mixed.value(None, None), 4.0, rtol=1e-12)


def test_members_that_lie_together_are_one_and_the_first_stays():
    values = np.array([[0.0, 1.0], [1e-6, 1.0 - 1e-6], [0.5, 0.5], [0.5 + 1e-6, 0.4999], [1.0, 0.0]])
    assert _apart(values) == [0, 3, 4]
    assert _apart(np.array([[2.0, 3.0]])) == [0]


def test_what_is_no_plan_and_what_are_not_two_indices_is_refused():
    failed = CapturePlan(CaptureResult(CaptureCode.NOT_FOUND, "no capture was found"))
    with pytest.raises(InputError, match="needs a verified plan; this one: no capture was found"):
        capture_front(failed)
    good = replace(
        failed,
        result=CaptureResult(CaptureCode.CAPTURED, "captured"),
        problem=SimpleNamespace(constraints=()),
    )
    with pytest.raises(InputError, match="two indices of different names; found base_disturbance"):
        capture_front(good, [BaseDisturbance(1.0)])
    with pytest.raises(InputError, match="levels is 1; 2 or more"):
        capture_front(good, [BaseDisturbance(1.0), replace(BaseDisturbance(2.0), name="again")], levels=1)
