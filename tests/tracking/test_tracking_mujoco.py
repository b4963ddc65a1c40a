"""Tracked motions made again in MuJoCo, and its generalized Jacobian along them."""

from __future__ import annotations

import dataclasses
import json

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.crosscheck.mujoco_model import branch_order, to_mjmodel
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.yaml_schema import RobotModel
from jffsr.tracking.mujoco_check import check_tracked
from jffsr.tracking.mujoco_report import FORCES, MOMENTUM
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track
from jffsr.trajectories.cartesian.interface import ToolTarget

PUSH = np.array([2.0, -4.0, 1.0, 1.6, -1.2, 2.2])


def nodding(centre, quaternion):
    """A target that goes to and fro about a point; the attitude stays."""

    def target(time):
        swing = jnp.array([0.1, -0.08, 0.12])
        turn = jnp.concatenate([0.7 * jnp.cos(0.7 * time) * swing, jnp.zeros(3)])
        return ToolTarget(centre + jnp.sin(0.7 * time) * swing, quaternion, turn, jnp.zeros(6))

    return target


@pytest.fixture(scope="module")
def wu(robots):
    """Wu's arm through its singularity, fed back, in 60 samples; the momentum is an argument."""
    robot = robots["wu_2018_6dof"]
    tracker = Tracker(lambda_max=0.0571, epsilon=0.0677, position_gain=0.5, attitude_gain=0.5)
    path, start = wu_path.wu_path(robot, 15.0), wu_path.state_at(wu_path.START)
    run = jit(lambda momentum: track(robot, path, start, tracker, momentum=momentum))
    return robot, {"at rest": run(np.zeros(6)), "pushed": run(PUSH)}


@pytest.fixture(scope="module")
def taking_turns():
    """The second of two arms whose joints turn and slide and are numbered by turns, where MuJoCo goes along one arm."""
    link = {"mass": 4.0, "com": [0.3, 0.0, 0.05], "inertia": {"xx": 0.05, "yy": 0.3, "zz": 0.3}}

    def joint(name, kind, parent, child, position, axis):
        place = {"parent": parent, "child": child, "position": position}
        return {"name": name, "type": kind, "axis": axis, **place}

    model = RobotModel.model_validate(
        {
            "name": "taking_turns",
            "base": {"name": "base", "mass": 40.0, "inertia": {"xx": 5.0, "yy": 6.0, "zz": 7.0}},
            "links": [{"name": name, **link} for name in ("left1", "right1", "left2", "right2")],
            "joints": [
                joint("left_shoulder", "revolute", "base", "left1", [0.5, 0.3, 0.0], [0, 0, 1]),
                joint("right_shoulder", "revolute", "base", "right1", [-0.5, 0.2, 0.0], [0, 1, 0]),
                joint("left_elbow", "revolute", "left1", "left2", [0.6, 0.0, 0.1], [0, 1, 0]),
                joint("right_slide", "prismatic", "right1", "right2", [0.0, 0.1, 0.6], [1, 0, 0]),
            ],
            "end_effectors": [
                {"name": "left", "link": "left2", "position": [0.4, 0.0, 0.0]},
                {"name": "right", "link": "right2", "position": [0.0, 0.5, 0.1], "rpy_deg": [0, 90, 20]},
            ],
        }
    )
    robot = build_robot(model.describe("taking_turns"))
    start = wu_path.state_at([0.3, -0.2, 0.1, 0.2], (0.3, -1.0, 2.0), np.array([0.8, -0.2, 0.4, 0.4]))
    position, quaternion = end_effector_pose(robot, kinematics(robot, start), "right")
    tracker = Tracker(method="damped", freedom="position", limits="ignore", substeps=2)
    target = nodding(position, quaternion)
    run = jit(lambda momentum: track(robot, target, start, tracker, 3.0, momentum, "right"))
    return robot, run(PUSH)


@pytest.mark.parametrize("start", ["at rest", "pushed"])
def test_mujoco_makes_the_published_path_again(wu, start):
    """Base and tool to 1e-9 by torques and impulses and to 1e-11 by the momentum equation, through the singularity."""
    robot, motions = wu
    report = check_tracked(robot, motions[start], steps=(2e-2, 1e-2))
    assert report.passed, report.sentence
    coarse, fine = report.of_way(FORCES)
    assert (coarse.step, fine.step) == pytest.approx((2e-2, 1e-2))
    for what, difference in fine.pose.items():
        assert difference < 1e-8, what
        assert difference < coarse.pose[what] / 4, what
    (conserved,) = report.of_way(MOMENTUM)
    assert max(conserved.pose.values()) < 1e-10
    for entry in report.comparisons:
        assert entry.tracking < 1e-6
        assert max(entry.momentum_linear, entry.momentum_angular) < 1e-10


def test_mujoco_makes_a_branched_arm_s_motion_again(taking_turns):
    robot, tracked = taking_turns
    np.testing.assert_array_equal(branch_order(robot.topology), [0, 2, 1, 3])
    assert np.ptp(np.asarray(tracked.motion.joint_position), axis=0).max() > 0.05
    report = check_tracked(robot, tracked, "right", steps=(2e-3,))
    assert report.passed, report.sentence
    assert max(report.of_way(FORCES)[-1].pose.values()) < 1e-7
    # By the other tool the base is the same and the tool is not.
    report = check_tracked(robot, tracked, "left", steps=(2e-3,))
    assert not report.passed
    assert "the tool position differs by" in report.sentence
    assert "base" not in report.sentence


def test_a_motion_of_another_robot_is_contradicted_by_both_ways(wu):
    robot, motions = wu
    mass = robot.mass.copy()
    mass[6] *= 1.001
    report = check_tracked(robot.replace(mass=mass), motions["at rest"], steps=(1e-2,))
    assert not report.passed
    assert report.sentence.startswith(
        "MuJoCo contradicts the tracked motion: by the torques and impulses the "
    )
    assert "; by the momentum equation the base attitude differs by" in report.sentence


def test_each_tolerance_counts(wu):
    robot, motions = wu
    report = check_tracked(robot, motions["at rest"], steps=(2e-2, 1e-2))
    for name, value in (("forces", 1e-13), ("momentum", 1e-18), ("tracking", 1e-13), ("conservation", 1e-18)):
        strict = dataclasses.replace(report.tolerances, **{name: value})
        assert not dataclasses.replace(report, tolerances=strict).passed, name
    rows = list(report.comparisons)
    for name in ("attitude", "tool_position", "tracking", "momentum_angular"):
        lost = [dataclasses.replace(rows[0]), dataclasses.replace(rows[1], **{name: float("nan")}), rows[2]]
        assert not dataclasses.replace(report, comparisons=tuple(lost)).passed, name
    # Differences that are not small must shrink with the step.
    growing = dataclasses.replace(rows[1], attitude=5e-7), rows[0], rows[2]
    growing = (dataclasses.replace(rows[0], attitude=4e-7), growing[0], rows[2])
    sentence = dataclasses.replace(report, comparisons=growing).sentence
    assert "the difference in base attitude does not shrink with the step" in sentence


def test_the_report_reads_as_a_table_and_as_json(wu):
    robot, motions = wu
    report = check_tracked(robot, motions["pushed"], steps=(2e-2,))
    lines = report.to_text().splitlines()
    assert len(lines) == 2 + 2 + 1
    assert lines[2].startswith("torques and impulses")
    assert lines[3].startswith("momentum equation")
    assert lines[-1] == report.sentence
    found = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    assert found["passed"] is True
    assert found["momentum"] == pytest.approx(PUSH)
    assert [row["way"] for row in found["comparisons"]] == [FORCES, MOMENTUM]
    assert found["comparisons"][0]["step"] == 2e-2
    assert found["comparisons"][1]["step"] is None


def test_what_cannot_be_checked_is_refused(wu):
    robot, motions = wu
    tracked = motions["at rest"]
    held = dataclasses.replace(tracked, motion=dataclasses.replace(tracked.motion, base_mode="fixed"))
    broken = tracked.motion.joint_position.at[3, 2].set(jnp.nan)
    broken = dataclasses.replace(tracked, motion=dataclasses.replace(tracked.motion, joint_position=broken))
    for motion, steps, complaint in (
        (held, (1e-2,), "base_mode is 'fixed'; only floating bases are driven in MuJoCo"),
        (broken, (1e-2,), "the motion is not finite"),
        (tracked, (), "no step length was given"),
        (tracked, (-1.0,), "must be positive"),
    ):
        with pytest.raises(InputError, match=complaint):
            check_tracked(robot, motion, steps=steps)


def test_singular_values_are_those_of_mujoco_s_generalized_jacobian(wu):
    """J_m - J_b H_b^-1 H_bm of MuJoCo's own Jacobians and inertia matrix; the determinant but for the base's axes."""
    robot, motions = wu
    tracked, model = motions["pushed"], to_mjmodel(robot, 1e-2)
    data, inertia = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    motion = tracked.motion
    for k in range(0, 61, 6):
        data.qpos[:] = np.concatenate(
            [motion.base_position[k], motion.base_quaternion[k], motion.joint_position[k]]
        )
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, inertia)
        mujoco.mj_jacSite(model, data, linear, angular, 0)
        jacobian = np.vstack([linear, angular])
        generalized = jacobian[:, 6:] - jacobian[:, :6] @ np.linalg.solve(inertia[:6, :6], inertia[:6, 6:])
        np.testing.assert_allclose(
            tracked.singular_values[k], np.linalg.svd(generalized, compute_uv=False), atol=1e-12
        )
        assert abs(float(tracked.determinant[k]) - np.linalg.det(generalized)) < 1e-12
