"""Every term against its definition written again in numpy and scipy, and against oracle numbers."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import (
    EULER_ZXY,
    ROTATION_VECTOR,
    AttitudeChange,
    AttitudeExcursion,
    GoalAttitude,
    JointAcceleration,
    JointRate,
    ToolPosition,
    UserTerm,
)
from jffsr.rollouts.motion import Motion

RATE_LIMIT = np.array([0.5, 1.0, 1.5, 2.0, 2.5, np.inf])
ACCELERATION_LIMIT = np.array([np.inf, 0.7, 1.4, 3.0, 0.2, 1.1])
EXCURSION_LIMIT = np.array([0.1, 0.25, np.inf])


def relative_attitude(motion: Motion) -> Rotation:
    rotation = Rotation.from_quat(np.roll(np.asarray(motion.base_quaternion), -1, axis=1))
    return rotation[0].inv() * rotation


def expected_overrun(values, limit) -> float:
    peaks = np.max(np.abs(np.asarray(values)), axis=0)
    return float(sum(max(0.0, p / m - 1) for p, m in zip(peaks, limit, strict=True)))


def expected_angles(motion: Motion, measure: str) -> np.ndarray:
    relative = relative_attitude(motion)
    if measure == ROTATION_VECTOR:
        return relative.as_rotvec()
    # Turned about z, then x, then y; listed as the limits are, about x, y, z.
    return relative.as_euler("ZXY")[:, [1, 2, 0]]


@pytest.mark.parametrize("measure", [ROTATION_VECTOR, EULER_ZXY])
def test_attitude_change(tumbling, measure):
    term = AttitudeChange(np.array(1.0), measure)
    expected = np.linalg.norm(expected_angles(tumbling, measure)[-1])
    assert term.value(None, tumbling) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("measure", [ROTATION_VECTOR, EULER_ZXY])
def test_attitude_excursion(tumbling, measure):
    term = AttitudeExcursion(np.array(1.0), EXCURSION_LIMIT, measure)
    expected = expected_overrun(expected_angles(tumbling, measure), EXCURSION_LIMIT)
    assert expected > 0.1
    assert term.value(None, tumbling) == pytest.approx(expected, rel=1e-12)


def test_the_two_measures_differ(tumbling):
    a, b = (expected_angles(tumbling, m)[-1] for m in (ROTATION_VECTOR, EULER_ZXY))
    assert abs(np.linalg.norm(a) - np.linalg.norm(b)) > 1e-6


def test_peaks_are_read_between_the_samples_too(tumbling):
    """The grid has midpoints; a peak there counts."""
    velocity = np.zeros((21, 6))
    velocity[7, 2] = -3.0
    motion = replace(tumbling, joint_grid=replace(tumbling.joint_grid, joint_velocity=velocity))
    assert JointRate(np.array(1.0), RATE_LIMIT).value(None, motion) == pytest.approx(1.0)


def test_joint_rate(tumbling):
    expected = expected_overrun(tumbling.joint_grid.joint_velocity, RATE_LIMIT)
    assert JointRate(np.array(1.0), RATE_LIMIT).value(None, tumbling) == pytest.approx(expected, rel=1e-13)


def test_joint_acceleration(tumbling):
    expected = expected_overrun(tumbling.joint_grid.joint_acceleration, ACCELERATION_LIMIT)
    term = JointAcceleration(np.array(1.0), ACCELERATION_LIMIT)
    assert term.value(None, tumbling) == pytest.approx(expected, rel=1e-13)


def test_infinite_limits_leave_nothing(tumbling):
    endless = np.full(6, np.inf)
    for term in (
        JointRate(np.array(0.01), endless),
        JointAcceleration(np.array(0.01), endless),
        AttitudeExcursion(np.array(0.01), np.full(3, np.inf)),
    ):
        assert term.value(None, tumbling) == 0.0
        assert term.smooth(None, tumbling, Smoothing()) < 1e-12


def test_goal_attitude_is_the_sine_of_half_the_angle(tumbling):
    final = Rotation.from_quat(np.roll(np.asarray(tumbling.base_quaternion[-1]), -1))
    for angle in (0.0, 0.2, 1.0, np.pi):
        goal = final * Rotation.from_rotvec(angle * np.array([0.6, -0.64, 0.48]))
        for sign in (1.0, -1.0):
            quaternion = sign * np.roll(goal.as_quat(), 1)
            value = GoalAttitude(np.array(1.0), quaternion).value(None, tumbling)
            assert value == pytest.approx(np.sin(angle / 2), abs=1e-14)


@pytest.fixture(scope="module")
def tool_distance():
    return jax.jit(lambda term, robot, motion: term.value(robot, motion))


def test_tool_position_from_oracle_numbers(oracles, make_motion, tool_distance):
    """Tool and system centre of mass of two postures, by Pinocchio: their offsets differ by the error."""
    oracle = oracles["wu6"]
    cases = oracle.data["cases"]
    for here, there in ((0, 1), (2, 3), (4, 4)):
        final, goal = cases[here], cases[there]
        offset = [
            np.subtract(case["outputs"]["end_effectors"][0]["position"], case["outputs"]["system_com"])
            for case in (final, goal)
        ]
        motion = make_motion([final["inputs"]["base_quat_wxyz"]] * 3, np.tile(final["inputs"]["q"], (5, 1)))
        term = ToolPosition(
            np.array(1.0), np.array(goal["inputs"]["q"]), np.array(goal["inputs"]["base_quat_wxyz"])
        )
        expected = np.linalg.norm(offset[0] - offset[1])
        assert tool_distance(term, oracle.robot, motion) == pytest.approx(expected, abs=1e-12)


def tool_from_com(robot, quaternion, joints) -> np.ndarray:
    """The tool relative to the system centre of mass, link by link, for a serial arm of revolute joints."""
    rotation = Rotation.from_quat(np.roll(quaternion, -1))
    origin, moment = np.zeros(3), np.zeros(3)
    for i, q in enumerate(joints):
        origin = origin + rotation.apply(robot.joint_position[i])
        rotation = rotation * Rotation.from_matrix(robot.joint_rotation[i])
        rotation = rotation * Rotation.from_rotvec(q * np.asarray(robot.joint_axis[i]))
        moment = moment + robot.mass[i + 1] * (origin + rotation.apply(robot.link_com[i]))
    tool = origin + rotation.apply(robot.end_effector_position[0])
    return tool - moment / np.sum(robot.mass)


def test_tool_position_by_hand(robots, tumbling, tool_distance):
    robot, goal = robots["wu_2018_6dof"], np.array([0.1, -0.4, 1.2, -2.0, 0.3, 0.9])
    attitude = np.array([0.5, -0.5, 0.1, 0.7]) / np.linalg.norm([0.5, -0.5, 0.1, 0.7])
    here = tool_from_com(
        robot, np.asarray(tumbling.base_quaternion[-1]), np.asarray(tumbling.joint_position[-1])
    )
    expected = np.linalg.norm(here - tool_from_com(robot, attitude, goal))
    term = ToolPosition(np.array(1.0), goal, attitude)
    assert tool_distance(term, robot, tumbling) == pytest.approx(expected, rel=1e-12)


def test_users_own_term_is_taken_as_it_is(tumbling):
    term = UserTerm(np.array(2.0), lambda robot, motion: motion.time[-1] + 1.0, "mine")
    assert term.value(None, tumbling) == pytest.approx(2.0)
    assert term.smooth(None, tumbling, Smoothing()) == term.value(None, tumbling)
