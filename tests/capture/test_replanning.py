"""A capture planned anew on its way: the new plan goes on where the old one was, and ends at the frame now known."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.interpolate import BSpline

import jffsr
from jffsr.capture.captures import CaptureSettings
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.problem import capture_problem
from jffsr.capture.replanning import Knowledge, Leg, ReplannedCapture, replanned, rest_of
from jffsr.errors import InputError
from jffsr.rollouts.rollout import rollout
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion
from jffsr.trajectories.bspline import ClampedBSpline

START, UNIT = np.array([0.3, -0.4, 0.2]), np.array([1.0, 0.0, 0.0, 0.0])
DURATION = 12.0


def spline(control_points, **keywords):
    law = ClampedBSpline.between(START, None, DURATION, 4, control_points, **keywords)
    return replace(law, inner=np.random.default_rng(control_points).uniform(-1, 1, law.inner.shape))


def test_the_rest_of_a_spline_is_found_again():
    """The rest of a polynomial is one: with one span the new law can be the old one, point by point."""
    law = spline(5)
    since = 5.0
    position, rate, acceleration = (np.asarray(x) for x in law(since))
    onwards = ClampedBSpline.between(
        position, None, DURATION - since, 4, 5, start_rate=rate, start_acceleration=acceleration
    )
    found = replace(onwards, inner=rest_of(law, since, onwards))
    peer = BSpline(law.knots, np.asarray(law.control_points), 4)
    times = np.linspace(0, DURATION - since, 23)
    np.testing.assert_allclose(found.on_grid(times)[0].T, peer((since + times) / DURATION), atol=1e-12)


def test_the_rest_of_a_spline_of_several_spans_comes_near():
    law, since = spline(8), 4.0
    position, rate, acceleration = (np.asarray(x) for x in law(since))
    onwards = ClampedBSpline.between(
        position, None, DURATION - since, 4, 8, start_rate=rate, start_acceleration=acceleration
    )
    found = replace(onwards, inner=rest_of(law, since, onwards))
    times = np.linspace(0, DURATION - since, 23)
    off = found.on_grid(times)[0] - law.on_grid(since + times)[0]
    assert 1e-6 < np.max(np.abs(off)) < 0.02


@pytest.fixture(scope="module")
def robot():
    return jffsr.load_robot("ye_planar3")


def path_of(shift=0.0):
    """A handle in the plane of a planar arm, turning slowly; shifted by some metres along x."""
    target = Target.create((1.0, 1.0, 1.0), grasps={"handle": ((-0.3, 0.0, 0.0), UNIT)})
    start = TargetState.create((3.2 + shift, 0.9, 0.0), (0.0, 0.0, 0.0), UNIT, (0.0, 0.0, 0.01))
    return GraspPath.create(target_motion(target, start, 30.0, 4))


@pytest.mark.slow
def test_a_plan_follows_what_is_known(robot):
    state = jffsr.State(np.zeros(3), UNIT, START)
    settings = CaptureSettings(half_angle=None, num_steps=80, tolerance=1e-8)
    problem = capture_problem(
        robot, path_of(), state, DURATION, half_angle=None, num_steps=80, tolerance=1e-8
    )
    free = np.tile(START, 5)
    shifts = {1.0: 0.05, 4.0: 0.03, 7.0: 0.031, 11.0: 0.5}
    known = [Knowledge(time, path_of(shift)) for time, shift in shifts.items()]
    found = replanned(problem, free, known, settings)
    # The last comes too late to be heeded.
    assert [leg.begin for leg in found.legs] == [0.0, 1.0, 4.0, 7.0]
    assert found.refused == ()
    assert found.duration == pytest.approx(DURATION, abs=1e-12)
    assert np.max(np.abs(found.error(path_of(0.031)))) < 1e-8
    np.testing.assert_allclose(found.error(path_of())[:3], [0.031, 0.0, 0.0], atol=1e-7)
    # One motion, continuous up to the acceleration, and simulated as one it ends at the frame known last.
    for leg in found.legs[1:]:
        before, after = (np.stack(found(leg.begin + side)) for side in (-1e-9, 0.0))
        np.testing.assert_allclose(before, after, atol=1e-7)
    motion = jax.jit(lambda: rollout(robot, found, state, DURATION, 480))()
    end = jffsr.State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])
    place, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, end))
    wanted, *_ = path_of(0.031).frame(DURATION, DURATION)
    np.testing.assert_allclose(place, wanted, atol=1e-6)


def test_knowledge_out_of_order_is_refused(robot):
    state = jffsr.State(np.zeros(3), UNIT, START)
    problem = capture_problem(robot, path_of(), state, DURATION, half_angle=None, num_steps=4)
    known = [Knowledge(0.0, path_of())]
    with pytest.raises(InputError, match="knowledge of 0 s comes after that of 0 s"):
        replanned(problem, np.tile(START, 5), known)


def test_what_comes_too_late_is_not_heeded(robot):
    state = jffsr.State(np.zeros(3), UNIT, START)
    problem = capture_problem(robot, path_of(), state, DURATION, half_angle=None, num_steps=4)
    found = replanned(problem, np.tile(START, 5), [Knowledge(10.5, path_of(0.1))])
    assert isinstance(found, ReplannedCapture)
    assert found.legs == (Leg(0.0, problem, found.legs[0].free),)
