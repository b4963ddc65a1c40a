"""Singularities of arms in space: the wrist, frames, units, and what is refused."""

from __future__ import annotations

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.dynamics.kinematics import jacobians, kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.errors import InputError
from jffsr.robots.state import State
from jffsr.tracking.singularity.along import singularities
from jffsr.tracking.singularity.between import Postures
from jffsr.tracking.singularity.measures import many_jacobians
from jffsr.tracking.singularity.nearest import Bounds, kind_of
from jffsr.tracking.singularity.scan import singularity_scan
from jffsr.tracking.singularity.task import make_task
from jffsr.tracking.singularity.words import direction_in_words, joints_in_words

HOME = np.deg2rad([175.0, -60, -60, 0, 210, 5])
# A base attitude that favours no axis.
TURNED = np.array([0.8, 0.1, -0.5, 0.3]) / np.linalg.norm([0.8, 0.1, -0.5, 0.3])


@pytest.fixture(scope="module")
def wu(robots):
    return robots["wu_2018_6dof"]


def wrist_sweep(middle_deg):
    """Joint 5 through `middle_deg` in ten seconds, joint 4 along with it, the base turned and away from the origin."""
    time = np.linspace(0, 10, 41)
    joints = np.tile(HOME, (41, 1))
    joints[:, 4] = np.deg2rad(np.linspace(middle_deg - 20, middle_deg + 20, 41))
    joints[:, 3] = np.deg2rad(np.linspace(20, 35, 41))
    return Postures(
        time,
        joints,
        base_position=np.tile([1.0, 2.0, 3.0], (41, 1)),
        base_quaternion=np.tile(TURNED, (41, 1)),
    )


@pytest.fixture(scope="module")
def both_jacobians(wu):
    @jax.jit
    def at(q):
        kin = kinematics(wu, State(np.array([1.0, 2.0, 3.0]), TURNED, q))
        return generalized_jacobian(wu, kin), jacobians(wu, kin)[1], kin.axis

    return lambda q: jax.device_get(at(q))


@pytest.fixture(scope="module", params=[0.0, 180.0])
def wrist(request, wu):
    return request.param, singularities(wu, wrist_sweep(request.param))


def test_axes_four_and_six_align_where_joint_five_is_at_zero_or_half_a_turn(both_jacobians):
    for angle, sign in ((0.0, -1.0), (np.pi, 1.0)):
        q = HOME.copy()
        q[3:5] = 0.4, angle
        _, fixed, axis = both_jacobians(q)
        np.testing.assert_allclose(axis[3], sign * axis[5], atol=1e-12)
        assert abs(np.linalg.det(fixed)) < 1e-12


def test_the_wrist_is_found_and_is_kinematic(wrist, both_jacobians):
    """The base of 450 kg moves the singularity off the aligned axes by no more than a degree."""
    middle, report = wrist
    point = report.closest
    assert point.crossing
    assert abs(np.rad2deg(point.joint_position[4]) - middle) < 1.0
    assert point.kind == "kinematic"
    assert point.posture_distance < 1e-6
    assert 1e-4 < point.fixed_base_distance <= abs(point.joint_position[4] - np.deg2rad(middle)) + 1e-9
    generalized, fixed, _ = both_jacobians(point.joint_position)
    assert abs(np.linalg.det(generalized)) < 1e-9
    # The vectors that are reported do what their names say, with Jacobians from elsewhere.
    np.testing.assert_allclose(point.lost_I[0] @ generalized, 0.0, atol=1e-7)
    np.testing.assert_allclose(generalized @ point.idle_joints[0], 0.0, atol=1e-7)
    np.testing.assert_allclose(
        point.fixed_base_singular_value, np.linalg.svd(fixed, compute_uv=False)[-1], rtol=1e-6
    )
    idle = np.abs(point.idle_joints[0])
    assert set(np.argsort(idle)[-2:]) == {3, 5}
    assert "joint4" in report.to_dict()["closest"]["idle_in_words"][0]
    assert report.time[0] < report.intervals[0].start < point.time < report.intervals[0].end < report.time[-1]


def test_base_pose_turns_the_lost_direction_and_nothing_else(wu):
    motion = wrist_sweep(180.0)
    report = singularities(wu, motion)
    plain = singularities(wu, Postures(motion.time, motion.joint_position))
    np.testing.assert_allclose(report.singular_values, plain.singular_values, rtol=0, atol=1e-12)
    np.testing.assert_allclose(report.determinant, plain.determinant, rtol=0, atol=1e-12)
    here, there = report.closest, plain.closest
    assert abs(here.time - there.time) < 1e-8
    np.testing.assert_allclose(abs(np.sum(here.lost_E[0] * there.lost_E[0])), 1.0, atol=1e-9)
    assert abs(np.sum(here.lost_I[0] * there.lost_I[0])) < 0.99
    turn = Rotation.from_quat(TURNED, scalar_first=True)
    np.testing.assert_allclose(here.tool_position - turn.apply(there.tool_position), [1, 2, 3], atol=1e-6)


def test_a_direction_less_of_the_tool(wu):
    """Without the roll about the tool's z, five directions are left, whatever the base's attitude."""
    five = make_task(("x", "y", "z", "about_x", "about_y"), "tool", 1.0)
    q = np.tile(HOME, (2, 1))
    matrices = many_jacobians(wu, q, np.stack([TURNED, [1.0, 0, 0, 0]]), "tool", "floating", five).generalized
    assert matrices.shape == (2, 5, 6)
    np.testing.assert_allclose(matrices[0], matrices[1], atol=1e-12)


@pytest.mark.slow
def test_the_tool_frame_says_the_same_of_a_plane(robots):
    robot = robots["hu_2011_planar2"]
    time = np.linspace(0, 1, 11)
    joints = np.stack([1 + time, 0.6 - time], axis=1)
    turned = np.tile([np.cos(0.4), 0, 0, np.sin(0.4)], (11, 1))
    motion = Postures(time, joints, base_quaternion=turned)
    of_tool, of_space = (
        singularities(robot, motion, directions=("x", "y"), frame=frame) for frame in ("tool", "inertial")
    )
    np.testing.assert_allclose(of_tool.determinant, of_space.determinant, atol=1e-12)
    for name in ("lost_I", "lost_E", "idle_joints"):
        ours, theirs = getattr(of_tool.closest, name)[0], getattr(of_space.closest, name)[0]
        np.testing.assert_allclose(ours * np.sign(ours @ theirs), theirs, atol=1e-9)
    assert of_tool.closest.kind == of_space.closest.kind


def test_a_length_for_one_radian_scales_turns_and_sliding_joints(robots):
    robot, scale = robots["two_arms"], 0.4
    q, base = np.array([[0.3, -0.4, 0.1, 0.2, 0.5]])[:, : robot.num_joints], TURNED[None]
    plain = many_jacobians(robot, q, base, "left", "floating", make_task(None, "inertial", 1.0))
    scaled = many_jacobians(robot, q, base, "left", "floating", make_task(None, "inertial", scale))
    rows = np.array([1, 1, 1, scale, scale, scale])[:, None]
    columns = np.where(robot.topology.is_revolute, 1.0, scale)
    for ours, theirs in ((scaled.generalized, plain.generalized), (scaled.fixed, plain.fixed)):
        np.testing.assert_allclose(ours[0], rows * theirs[0] * columns, atol=1e-14)
    assert np.any(~robot.topology.is_revolute)


def test_words():
    assert direction_in_words(np.array([0, 0, 0.2, 0, -0.98, 0])) == "turning about the tool's y, 0.98"
    both = direction_in_words(np.array([0.6, 0, 0, 0, 0, -0.8]))
    assert both == "turning about the tool's z, 0.80; moving along the tool's x, -0.60"
    assert joints_in_words(np.array([0.1, -0.7, 0.7]), ["a", "b", "c"]) in (
        "b +0.70, c -0.70",
        "c +0.70, b -0.70",
    )


def test_kind_by_distance_and_direction():
    bounds = Bounds(0.1, 0.2)
    assert kind_of(0.0, 0.09, 0.99, bounds) == "kinematic"
    assert kind_of(0.0, 0.09, 0.5, bounds) == "mixed"
    assert kind_of(0.0, 0.15, 0.99, bounds) == "mixed"
    assert kind_of(0.0, 0.21, 0.99, bounds) == "dynamic"
    assert kind_of(0.0, np.inf, 0.0, bounds) == "dynamic"
    assert kind_of(np.inf, 0.0, 1.0, bounds) == "mixed"


def test_public_names():
    assert jffsr.singularities is singularities
    assert jffsr.singularity_scan is singularity_scan


@pytest.mark.parametrize(
    ("keywords", "sentence"),
    [
        ({"directions": ("x", "about_w")}, "direction 'about_w' is unknown.*did you mean 'about_"),
        ({"directions": ("x", "x")}, "name each wanted one once"),
        ({"directions": ()}, "name each wanted one once"),
        ({"frame": "tol"}, "frame is 'tol'; allowed are inertial or tool; did you mean 'tool'"),
        ({"length_scale": 0.0}, "length_scale is 0.0; it must be positive"),
        ({"threshold": -1.0}, "threshold is -1.0; it must be positive"),
        ({"base_mode": "flying"}, "base_mode is 'flying'"),
        ({"end_effector": "hand"}, "has no end effector 'hand'"),
    ],
)
def test_arguments_are_refused(wu, keywords, sentence):
    motion = Postures(np.zeros(1), HOME[None])
    with pytest.raises(InputError, match=sentence):
        singularities(wu, motion, **keywords)
    with pytest.raises(InputError, match=sentence):
        singularity_scan(wu, HOME[None], **keywords)


@pytest.mark.parametrize(
    ("motion", "sentence"),
    [
        (Postures(np.zeros(1), HOME[None, :5]), r"joint_position has shape \(1, 5\)"),
        (Postures(np.zeros(2), np.tile(HOME, (2, 1))), "increasing times"),
        (Postures(np.zeros(1), HOME[None] * np.nan), "joint_position is not finite at time 0 s"),
        (Postures(np.zeros(1), HOME[None], base_quaternion=np.ones((1, 4))), "unit quaternions"),
        (3.0, "a motion has time and joint_position; found float"),
    ],
)
def test_motions_are_refused(wu, motion, sentence):
    with pytest.raises(InputError, match=sentence):
        singularities(wu, motion)


def test_a_sliding_joint_without_limits_is_refused_in_a_scan(robots):
    with pytest.raises(InputError, match="slides without limits; give postures instead"):
        singularity_scan(robots["two_arms"], 10)
    with pytest.raises(InputError, match="postures is 0"):
        singularity_scan(robots["two_arms"], 0)
