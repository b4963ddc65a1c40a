"""What cannot be captured is told before anything is planned, by a code and a sentence."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import jffsr
from jffsr.capture.checks import check_capture
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.outcome import CaptureCode, explain_capture
from jffsr.errors import InputError
from jffsr.robots.geometry import BOX, Geometry, Shape
from jffsr.target.body import Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import target_motion

BOX_SHAPE = Shape("hull", BOX, "target", np.zeros(3), np.eye(3), np.array([0.3, 0.25, 0.2]))
GEOMETRY = Geometry((BOX_SHAPE,))
UNIT = (1.0, 0.0, 0.0, 0.0)
START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])


@pytest.fixture(scope="module")
def robot():
    return jffsr.load_robot("servicer_7dof")


def path(grasp=(-0.45, 0.0, 0.0), position=(2.4, 0.0, -0.5)):
    target = Target.create((0.65, 0.95, 1.0), grasps={"handle": (grasp, UNIT)})
    start = TargetState.create(position, (0.0, 0.0, 0.0), UNIT, (0.05, 0.02, 0.0))
    return GraspPath.create(target_motion(target, start, 10.0, 4))


def state(joints=START):
    return jffsr.State(np.zeros(3), np.array(UNIT), joints)


def test_nothing_is_said_where_nothing_is_wrong(robot):
    model = jffsr.ClearanceModel.create(robot, GEOMETRY)
    assert check_capture(robot, path(), state(), model, GEOMETRY) is None


def test_a_grasp_frame_inside_the_body_is_named(robot):
    wrong = check_capture(robot, path(grasp=(-0.1, 0.2, 0.0)), state(), geometry=GEOMETRY)
    assert wrong.code is CaptureCode.GRASP_INSIDE_BODY
    assert "'hull'" in wrong.sentence
    assert not wrong.success


def test_a_start_in_collision_names_both_bodies(robot):
    model = jffsr.ClearanceModel.create(robot, GEOMETRY)
    tool, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, state()))
    wrong = check_capture(robot, path(position=np.asarray(tool)), state(), model)
    assert wrong.code is CaptureCode.START_IN_COLLISION
    assert "'target'" in wrong.sentence
    assert "overlap by" in wrong.sentence


@pytest.mark.parametrize(("deviation", "code"), [(1e-4, None), (0.5, CaptureCode.ESTIMATE_NOT_CONVERGED)])
def test_an_estimate_that_has_not_converged_is_no_ground_for_a_plan(robot, deviation, code):
    prediction = SimpleNamespace(covariance=deviation**2 * np.eye(12))
    wrong = check_capture(robot, path(), state(), prediction=prediction)
    assert (wrong and wrong.code) == code


def test_moments_that_no_body_can_have_are_refused():
    with pytest.raises(InputError, match="triangle"):
        Target.create((0.2, 0.3, 1.0), grasps={"handle": ((0.0, 0.0, 0.0), UNIT)})


@pytest.mark.parametrize(
    ("code", "said"),
    [
        (CaptureCode.NEVER_FACING, "looks away"),
        (CaptureCode.NOT_FOUND, "no capture was found in 7 attempts"),
        (CaptureCode.CAPTURED, "captured"),
    ],
)
def test_each_code_has_its_sentence(code, said):
    result = explain_capture(code, attempts=7)
    assert said in result.sentence
    assert result.success == (code == CaptureCode.CAPTURED)
    # Of a plan it is said which limits were looked at.
    robot = SimpleNamespace(limits=SimpleNamespace(torque=np.array([20.0, np.inf])))
    problem = SimpleNamespace(robot=robot, objective=SimpleNamespace(terms=()), constraints=())
    kept = explain_capture(CaptureCode.CAPTURED, problem).sentence
    assert "every limit but those of torque, and every constraint, is kept" in kept
