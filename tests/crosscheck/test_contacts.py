"""A robot beside a target in MuJoCo with contacts on: clear where we say so, a touch where and when we say so."""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np
import pytest

import jffsr
from jffsr.clearance.along_motion import clearances
from jffsr.clearance.poses import body_poses
from jffsr.crosscheck.contact_model import to_contact_model
from jffsr.crosscheck.contacts import check_contacts
from jffsr.errors import InputError
from jffsr.robots.geometry import Geometry, Shape

DURATION, BEGIN = 2.0, 0.5
CUBE = Geometry((Shape("cube", "box", "cube", np.zeros(3), np.eye(3), np.full(3, 0.2)),))
START, GOAL = [0.2, 0.3], [1.2, 0.9]


class Spinning(NamedTuple):
    """A body that turns about its z axis, a principal one, at a steady rate, and drifts."""

    position: np.ndarray
    velocity: np.ndarray
    rate: float

    def __call__(self, time: float) -> jffsr.TargetState:
        half = 0.5 * self.rate * time
        quaternion = [np.cos(half), 0.0, 0.0, np.sin(half)]
        return jffsr.TargetState.create(
            self.position + time * self.velocity, self.velocity, quaternion, [0.0, 0.0, self.rate]
        )


class Samples(NamedTuple):
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray


@pytest.fixture(scope="module")
def scene():
    robot = jffsr.load_robot("hu_2011_planar2")
    trajectory = jffsr.SinePolynomial.between(START, GOAL, [-3.0] * 2, [3.0] * 2, DURATION)
    start = jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(2))
    target = jffsr.Target.create([4.0, 4.0, 5.0], 60.0, geometry=CUBE)
    return robot, trajectory, start, target, jffsr.ClearanceModel.create(robot, CUBE)


def check(scene, motion):
    robot, trajectory, start, target, model = scene
    return check_contacts(
        robot, trajectory, start, model, DURATION, target=target, target_motion=motion, begin=BEGIN
    )


def test_no_contact_where_there_is_none(scene):
    report = check(scene, Spinning(np.array([-3.0, 0.0, 0.0]), np.array([0.0, -0.05, 0.02]), 0.3))
    assert report.is_clear
    assert report.tracking < 1e-6
    assert report.tool_position < 1e-5
    assert report.tool_attitude < 1e-5
    assert report.target_position < 1e-9
    assert report.target_attitude < 1e-9


def test_a_target_in_the_way_is_touched_when_the_distance_says(scene):
    robot, trajectory, start, _, model = scene
    motion = jffsr.reference_rollout(robot, trajectory, start, DURATION, 400)
    samples = Samples(*(np.asarray(getattr(motion, name)) for name in Samples._fields))
    origins, rotations = body_poses(np, robot, *samples)
    tool = np.array(origins[-1])[:, -1] + np.array(rotations[-1])[:, :, -1] @ robot.end_effector_position[0]
    resting = Spinning(tool, np.zeros(3), 0.0)
    report = check(scene, resting)
    assert [contact.pair for contact in report.contacts] == [("link2", "target")]
    states = jffsr.TargetState(
        np.tile(tool, (401, 1)), np.zeros((401, 3)), np.tile([1.0, 0, 0, 0], (401, 1)), np.zeros((401, 3))
    )
    ours = clearances(model, robot, samples, states)[model.pair_names.index(("link2", "target"))]
    assert ours[0] > 0
    first = np.asarray(motion.time)[np.argmax(ours <= 0)]
    # Our distance of a cylinder and a box may be on the low side, by millimetres, never on the high one.
    assert first - 2 * DURATION / 400 <= report.contacts[0].time < first + 0.1
    assert report.contacts[0].depth > 0
    assert report.target_position > 1e-4
    assert "link2 and target touch at" in str(report.contacts[0])


def test_only_the_pairs_of_the_clearance_collide(scene):
    robot, _, _, target, model = scene
    compiled = to_contact_model(robot, model, 1e-3, target)
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    names = {compiled.body(name).id: name for name in (*robot.body_names, "target")}
    touching = {
        tuple(names[b] for b in sorted(compiled.geom_bodyid[contact.geom])) for contact in data.contact
    }
    # The target is at the base's place, and both joints are straight: neighbours overlap, and are left out.
    assert ("base", "target") in touching
    assert touching <= set(model.pair_names)
    assert compiled.body("target").mass == 60.0
    np.testing.assert_allclose(np.sort(compiled.body("target").inertia), [4.0, 4.0, 5.0])


def test_refusals(scene):
    robot, trajectory, start, target, model = scene
    with pytest.raises(InputError, match="target and target_motion belong together"):
        check_contacts(robot, trajectory, start, model, DURATION, target=target)
    with pytest.raises(InputError, match="the model has a target, and no pose"):
        check_contacts(robot, trajectory, start, model, DURATION)
