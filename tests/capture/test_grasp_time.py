"""When to grasp: the published case, a map looked up by SciPy, several frames, and answers where there is none."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial.transform import Rotation

import jffsr
from jffsr.capture.grasp_time import GraspTimeCode

HALF = np.sqrt(0.5)
GRASP = ((-0.351, 0.008, -0.428), (HALF, -HALF, 0.0, 0.0))
START = np.deg2rad([0.0, -60.0, 0.0, 45.0, 0.0, -15.0, 0.0])
TOOL = np.array([1.078, 0.252, -1.853])


def moving(grasps, position=(2.4, 0.0, -0.5), rate=(8.594, 2.865, 0.0), duration=60.0):
    """The published target with these grasp frames."""
    target = jffsr.Target.create((0.654, 0.950, 1.0), grasps=grasps)
    start = jffsr.TargetState.create(position, (0.0, 0.0, 0.0), (HALF, HALF, 0.0, 0.0), np.deg2rad(rate))
    return jffsr.target_motion(target, start, duration)


def box(low, high, cells=7, share=None):
    """A map of the published arm, one everywhere in a box, or of these shares (cells, cells, cells)."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    spacing = (high - low).max() / (cells - 1)
    share = np.ones((cells,) * 3) if share is None else share
    return jffsr.CapabilityMap(
        low,
        np.asarray(spacing),
        share,
        np.zeros((*share.shape, 1)),
        np.eye(3)[:1],
        "servicer_7dof",
        "tool",
        1,
        True,
    )


@pytest.fixture(scope="module")
def servicer(robots):
    return robots["servicer_7dof"], jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), START)


@pytest.fixture(scope="module")
def published():
    return moving({"grasp": GRASP})


def test_the_published_time_is_the_only_minimum(servicer, published):
    robot, state = servicer
    found = jffsr.grasp_time(robot, published, state, confirm=False)
    assert found.success
    # Beside it the minute's two ends, towards which the criterion falls, both to larger values.
    assert sorted(c.time for c in found.candidates if c.at_edge) == [0.0, 60.0]
    assert len(found.candidates) == 3
    assert not found.candidate.at_edge
    assert found.time == pytest.approx(31.4, abs=0.05)
    np.testing.assert_allclose(found.scans[0].windows, [[0.0, 60.0]])
    assert "31.4 s" in found.sentence


def test_curves_and_minima_are_those_of_the_formula(servicer, published):
    robot, state = servicer
    share = np.random.default_rng(4).uniform(0.2, 0.9, (7, 7, 7))
    capability = box([1.0, -1.2, -2.0], [3.4, 1.2, 0.4], share=share)
    found = jffsr.grasp_time(
        robot, published, state, capability, window=(5.0, 50.0), samples=901, confirm=False
    )
    looked_up = RegularGridInterpolator(capability.axes, share)

    def value(time):
        now = published(time)
        turn = Rotation.from_quat(np.asarray(now.quaternion), scalar_first=True)
        rho = np.asarray(now.position) + turn.apply(GRASP[0]) - TOOL
        approach = (turn * Rotation.from_quat(GRASP[1], scalar_first=True)).as_matrix()[:, 0]
        there = looked_up(rho + TOOL)[0]
        return (
            (2 * np.linalg.norm(rho) - approach @ rho) / (1 + there),
            approach @ rho / np.linalg.norm(rho),
            there,
        )

    scan = found.scans[0]
    some = slice(None, None, 60)
    expected = np.array([value(t) for t in scan.time[some]])
    # The start is printed to a millimetre.
    np.testing.assert_allclose(scan.value[some], expected[:, 0], atol=1e-3)
    np.testing.assert_allclose(scan.facing[some], expected[:, 1], atol=1e-3)
    np.testing.assert_allclose(scan.share[some], expected[:, 2], atol=1e-9)
    inside = [c for c in found.candidates if not c.at_edge]
    assert len(inside) == 2
    for candidate in inside:
        assert candidate.value <= scan.value[np.argmin(np.abs(scan.time - candidate.time))]
        beside = [value(candidate.time + step)[0] for step in (-1e-3, 0.0, 1e-3)]
        assert beside[1] <= min(beside) + 1e-9
        assert candidate.value == pytest.approx(beside[1], abs=1e-3)
    assert found.candidate.value == min(c.value for c in found.candidates)


@pytest.mark.slow
def test_the_best_of_several_frames_is_confirmed_by_the_floating_base(servicer):
    robot, state = servicer
    away = ((0.4, 0.0, 0.4), (0.0, 0.0, 1.0, 0.0))
    motion = moving({"away": away, "grasp": GRASP})
    found = jffsr.grasp_time(robot, motion, state, box([0.5, -1.5, -2.5], [3.5, 1.5, 0.5]))
    assert found.success
    assert found.candidate.grasp == "grasp"
    assert 25 < found.time < 35
    assert {scan.grasp for scan in found.scans} == {"away", "grasp"}
    assert "confirmed with the base floating" in found.sentence
    position, quaternion, _ = jffsr.grasp_frame(motion.target, motion(found.time), "grasp")
    # Along the bent way of the solution, by the rollout that shares no code with the search.
    solution, rest = found.solution, np.zeros(7)
    law = jffsr.Polynomial(
        START, solution.joint_position, rest, rest, rest, rest, found.time, solution.bow[:, None]
    )
    way = jffsr.reference_rollout(robot, law, state, found.time, 100)
    end = jffsr.State(way.base_position[-1], way.base_quaternion[-1], way.joint_position[-1])
    tool, attitude = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, end))
    np.testing.assert_allclose(tool, position, atol=3e-6)
    assert abs(np.dot(attitude, quaternion)) == pytest.approx(1.0, abs=1e-11)
    assert np.all(way.joint_position <= robot.limits.position_upper + 1e-9)
    assert np.all(way.joint_position >= robot.limits.position_lower - 1e-9)
    assert 0.01 < np.max(np.abs(solution.bow)) <= 1.0
    # With the base where it was, the tool would miss.
    still = jffsr.State(state.base_position, state.base_quaternion, solution.joint_position)
    away, _ = jffsr.end_effector_pose(robot, jffsr.kinematics(robot, still))
    assert np.linalg.norm(away - position) > 1e-2


@pytest.mark.slow
def test_a_point_that_the_arm_cannot_reach_is_not_confirmed(servicer):
    robot, state = servicer
    motion = moving({"grasp": GRASP}, position=(6.0, 0.0, -0.5))
    found = jffsr.grasp_time(robot, motion, state, box([4.0, -2.0, -2.5], [8.0, 2.0, 1.5]))
    assert found.code is GraspTimeCode.NOT_CONFIRMED
    assert found.time is None
    assert not found.success
    assert "at none of the" in found.sentence


def test_never_near_is_told(servicer, published):
    robot, state = servicer
    capability = box([-3.0, -1.0, -1.0], [-1.0, 1.0, 1.0])
    found = jffsr.grasp_time(robot, published, state, capability)
    assert found.code is GraspTimeCode.NEVER_NEAR
    assert found.candidate is None
    assert "never near: between 0 and 60 s the grasp frame never comes" in found.sentence
    nearest = found.scans[0].distance.min()
    assert f"{nearest:.4g} m away" in found.sentence


def test_never_facing_is_told(servicer):
    robot, state = servicer
    # At rest, on the side of the servicer, its first axis pointing back at the tool.
    motion = moving({"back": ((0.0, 0.0, -0.4), (0.0, 0.0, 0.0, 1.0))}, rate=(0.0, 0.0, 0.0), duration=10.0)
    found = jffsr.grasp_time(robot, motion, state, box([0.5, -1.5, -2.5], [3.5, 1.5, 0.5]), samples=11)
    assert found.code is GraspTimeCode.NEVER_FACING
    assert "points back at the tool" in found.sentence


def test_bad_requests_are_refused(servicer, published, robots):
    robot, state = servicer
    with pytest.raises(jffsr.InputError, match=r"the window is \[10, 70\] s"):
        jffsr.grasp_time(robot, published, state, window=(10.0, 70.0))
    with pytest.raises(
        jffsr.InputError, match="map is of 'servicer_7dof' with 'tool', the robot is 'wu_2018_6dof'"
    ):
        jffsr.grasp_time(robots["wu_2018_6dof"], published, state, box([0, 0, 0], [1, 1, 1]))
    with pytest.raises(jffsr.InputError, match="grasp 'handle' does not exist"):
        jffsr.grasp_time(robot, published, state, grasps=["handle"], confirm=False)
