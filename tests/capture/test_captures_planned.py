"""Captures planned from end to end, and made again in MuJoCo with contacts on."""

from __future__ import annotations

import jax
import numpy as np
import pytest

import jffsr
from jffsr.capture.candidates import CandidateSettings
from jffsr.capture.captures import CaptureSettings, CaptureTask, different_captures, plan_captures
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.outcome import CaptureCode
from jffsr.capture.plan import plan_capture
from jffsr.capture.terms import BaseDisturbance
from jffsr.robots.geometry import BOX, Geometry, Shape
from jffsr.target.body import Target
from jffsr.target.grasp_frames import grasp_frame
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

pytestmark = pytest.mark.slow

START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
UNIT = (1.0, 0.0, 0.0, 0.0)
AWAY = (0.0, 0.0, 0.0, 1.0)
GEOMETRY = Geometry((Shape("hull", BOX, "target", np.zeros(3), np.eye(3), np.array([0.3, 0.25, 0.2])),))
TARGET = Target.create(
    (10.0, 13.0, 15.0), 300.0, grasps={"handle": ((-0.45, 0.05, 0.0), UNIT)}, geometry=GEOMETRY
)
SETTINGS = CaptureSettings(
    candidates=CandidateSettings(window=(15.0, 40.0), times=2, starts=6, postures=3), lanes=8, num_steps=60
)


@pytest.fixture(scope="module")
def robot():
    return jffsr.load_robot("servicer_7dof")


@pytest.fixture(scope="module")
def state():
    return jffsr.State(np.zeros(3), np.array(UNIT), START)


@pytest.fixture(scope="module")
def paths():
    """A handle that looks at the arm, one that looks away and does not turn, one within the arm."""
    starts = [
        TargetState.create((2.2, 0.1, -1.5), (0.0, 0.0, 0.0), UNIT, (0.02, 0.01, -0.015)),
        TargetState.create((2.2, 0.1, -1.5), (0.0, 0.0, 0.0), AWAY, (0.0, 0.0, 0.0)),
        TargetState.create((1.1, 0.25, -1.85), (0.0, 0.0, 0.0), UNIT, (0.0, 0.0, 0.0)),
    ]
    return [GraspPath.create(target_motion(TARGET, start, 45.0, 12)) for start in starts]


@pytest.fixture(scope="module")
def model(robot):
    return jffsr.ClearanceModel.create(robot, GEOMETRY)


@pytest.fixture(scope="module")
def captures(robot, state, paths, model):
    return plan_captures(robot, [CaptureTask(path, model) for path in paths], state, SETTINGS)


def test_each_task_is_told_what_became_of_it(captures):
    expected = [CaptureCode.CAPTURED, CaptureCode.NEVER_FACING, CaptureCode.START_IN_COLLISION]
    assert [CaptureCode(code) for code in captures.code] == expected
    assert captures.attempts[0] >= 1
    assert np.all(captures.attempts[1:] == 0)
    assert [captures.result(k).success for k in range(3)] == [True, False, False]


def test_the_captured_one_is_captured_in_mujoco_without_a_touch(captures, robot, state, paths, model):
    problem, free = captures.problems[0], captures.free[0]
    law = problem.trajectory.with_free(free)
    duration = float(captures.duration[0])
    report = jffsr.check_contacts(
        robot, law, state, model, duration, target=TARGET, target_motion=paths[0].motion
    )
    assert report.is_clear
    assert report.tool_position < 1e-5
    assert report.tool_attitude < 1e-5
    # Ours at the end, by kinematics alone, is the handle's pose: so is MuJoCo's.
    end = jax.tree.map(lambda x: x[0], captures.motion)
    last = jffsr.State(end.base_position[-1], end.base_quaternion[-1], end.joint_position[-1])
    tool, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, last))
    handle, _, _ = grasp_frame(TARGET, paths[0].motion(duration))
    np.testing.assert_allclose(tool, handle, atol=1e-6)


def test_different_captures_keep_the_constraints_and_differ(robot, state, paths, model, captures):
    free = different_captures(robot, CaptureTask(paths[0], model), state, SETTINGS)
    assert len(free) >= 2
    # One after another by its own rollout, beside the handle's pose.
    problem = captures.problems[0]
    for one in free:
        motion = jax.device_get(problem.motion(one))
        end = jffsr.State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])
        tool, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, end))
        handle, _, _ = grasp_frame(TARGET, paths[0].motion(float(motion.time[-1])))
        np.testing.assert_allclose(tool, handle, atol=1e-6)
    assert np.max(np.abs(np.diff(free, axis=0))) > 0.01


def test_a_plan_is_made_better_and_stays_one(robot, state, paths, model):
    # The base's displacement follows from where the arm ends; its attitude is what a way can spare.
    terms = [BaseDisturbance(position=0.0)]
    plan = plan_capture(robot, paths[0], state, model, SETTINGS, terms=terms, geometry=GEOMETRY)
    assert plan.result.success
    assert np.max(np.abs(plan.error)) < 1e-6
    assert plan.cost < 0.95 * plan.before
    low, high = robot.limits.position_lower, robot.limits.position_upper
    assert np.all((plan.motion.joint_position >= low) & (plan.motion.joint_position <= high))
    rates = np.abs(plan.motion.joint_velocity) / robot.limits.velocity
    assert rates.max() <= 1.001
