"""Terms of a capture's index and the grasp's path in time, by hand."""

from __future__ import annotations

from types import SimpleNamespace

import jax
import numpy as np
import pytest

import jffsr
from jffsr.capture.captures import CaptureSettings, keeping_clear
from jffsr.capture.checks import check_capture
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.terms import BaseDisturbance, ExecutionTime, IndexAtMost, LostManipulability
from jffsr.objectives.clearance import MISS
from jffsr.objectives.composite import CompositeIndex
from jffsr.robots.geometry import BOX, Geometry, Shape
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

GRASP = np.array([-0.4, 0.1, -0.2])
# A quarter turn about z: the grasp frame's x axis is y of T.
QUARTER = np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)])


@pytest.fixture(scope="module")
def motion():
    target = Target.create((2.0, 2.5, 3.0), grasps={"handle": (GRASP, QUARTER)})
    start = TargetState.create((2.4, 0.0, -0.5), (0.1, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.1))
    return target_motion(target, start, 20.0, 12)


def moved(angle: float, displacement: np.ndarray):
    """A motion whose base turns by `angle`, rad, about an axis and is displaced."""
    axis = np.array([2.0, -1.0, 2.0]) / 3
    end = np.array([np.cos(angle / 2), *(np.sin(angle / 2) * axis)])
    return SimpleNamespace(
        base_position=np.stack([np.ones(3), 1 + displacement]),
        base_quaternion=np.stack([np.array([1.0, 0.0, 0.0, 0.0]), end]),
        time=np.array([0.0, 10.0]),
        joint_position=np.deg2rad([[10, -30, 20, 30, 15, -40, 5.0]]),
    )


def test_base_disturbance_is_the_weighted_displacement_and_the_sine_of_half_the_angle():
    run = moved(0.6, np.array([0.3, 0.0, -0.4]))
    term = BaseDisturbance(1.0, position=2.0, attitude=3.0)
    expected = np.hypot(2.0 * 0.5, 3.0 * np.sin(0.3))
    np.testing.assert_allclose(term.value(None, run), expected, rtol=1e-12)
    limit = IndexAtMost(CompositeIndex((term,)), 1.0)
    np.testing.assert_allclose(limit.inequality(None, run), [expected - 1.0], rtol=1e-12)


def test_what_is_verified_of_clearance_is_the_margin_itself():
    """Planned with the guard on top; where bodies are the margin apart, the constraint is missed by its tolerance."""
    model = jffsr.ClearanceModel.create(jffsr.load_robot("servicer_7dof"))
    keep = keeping_clear(None, model, CaptureSettings(margin=0.02, guard=0.003)).keep
    np.testing.assert_allclose([keep.margin, keep.tolerance], [0.023, 0.03], rtol=1e-12)
    np.testing.assert_allclose((keep.margin - 0.02) / MISS, keep.tolerance, rtol=1e-12)
    bare = keeping_clear(None, model, CaptureSettings(margin=0.02, guard=0.0)).keep
    np.testing.assert_allclose([bare.margin, bare.tolerance], [0.02, 1e-3], rtol=1e-12)


def test_execution_time_is_the_time_of_the_last_sample():
    index = CompositeIndex((ExecutionTime(scale=4.0),))
    np.testing.assert_allclose(index.value(None, moved(0.1, np.zeros(3))), 10.0 / 4.0, rtol=1e-15)


def test_the_wrench_is_given_in_the_grasp_frame_at_the_grasps_time(motion):
    """The target turns about z at 0.1 rad/s: at 10 s the grasp frame's x axis stands at 1 rad and a quarter turn."""
    robot, run = jffsr.load_robot("servicer_7dof"), moved(0.4, np.array([0.1, 0.2, 0.0]))
    path = GraspPath.create(motion)
    found = -float(jax.jit(lambda: LostManipulability(path).value(robot, run))())
    angle = 1.0 + np.pi / 2
    force = np.array([np.cos(angle), np.sin(angle), 0.0])
    turned = np.array([[np.cos(1.0), -np.sin(1.0), 0], [np.sin(1.0), np.cos(1.0), 0], [0, 0, 1.0]])
    state = jffsr.State(run.base_position[-1], run.base_quaternion[-1], run.joint_position[-1])
    tool = np.asarray(jffsr.generalized_jacobian(robot, jffsr.kinematics(robot, state)))
    # A force at the centre of mass is the same force at the tool with a moment about it.
    moment = np.cross(-turned @ GRASP, force)
    torque = tool.T @ np.concatenate([force, moment])
    np.testing.assert_allclose(found, 1 / np.linalg.norm(torque), rtol=1e-6)


def test_a_given_grasp_time_holds_whatever_the_duration(motion):
    path = GraspPath.create(motion, grasp_time=np.array(12.0))
    for duration in (4.0, 9.0):
        end = path.target_state(np.array(duration), np.array(duration))
        begin = path.target_state(np.array(0.0), np.array(duration))
        np.testing.assert_allclose(end.position, [2.4 + 0.1 * 12.0, 0.0, -0.5], rtol=1e-12)
        np.testing.assert_allclose(begin.position, [2.4 + 0.1 * (12.0 - duration), 0.0, -0.5], rtol=1e-12)


def test_a_target_that_is_in_the_way_only_when_it_is_grasped_is_no_start_in_collision():
    """It drifts to the tool's start; with the grasp's time given, where it is at the beginning is not known."""
    robot = jffsr.load_robot("servicer_7dof")
    start = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
    state = jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), start)
    tool, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state))
    box = Geometry((Shape("hull", BOX, "target", np.zeros(3), np.eye(3), np.full(3, 0.2)),))
    target = Target.create((2.0, 2.5, 3.0), grasps={"handle": ((-0.4, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))})
    drift = np.array([0.1, 0.0, 0.0])
    begin = TargetState.create(np.asarray(tool) - 20 * drift, drift, (1.0, 0.0, 0.0, 0.0), np.zeros(3))
    path = GraspPath.create(target_motion(target, begin, 25.0, 2), grasp_time=np.array(20.0))
    model = jffsr.ClearanceModel.create(robot, box)
    assert check_capture(robot, path, state, model, box) is None
