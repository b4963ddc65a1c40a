"""What a seven-axis arm, or a six-axis arm asked for less than six directions, does with its freedom."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.tracking.damping import raised_cosine
from jffsr.tracking.free_base import response
from jffsr.tracking.indices import pose_errors
from jffsr.tracking.inverses import null_space
from jffsr.tracking.redundancy import BaseAttitudeHeld, JointLimitAvoidance, ManipulabilityGradient, Situation
from jffsr.tracking.tool_task import pointing_error
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track

DURATION = 8.0
MOMENTUM = np.array([0.4, -0.3, 0.2, 0.5, -0.6, 0.3])
POSTURE = np.deg2rad([60.0, -60.0, 80.0, 45.0, -40.0, -50.0, 100.0])
FOLLOW = Tracker(
    lambda_max=0.02,
    epsilon=0.02,
    substeps=5,
    feedforward="mean",
    position_gain=18.0,
    attitude_gain=18.0,
    limits="ignore",
)
TASKS = {
    "none": (JointLimitAvoidance(0.0),),
    "limits": (JointLimitAvoidance(5.0),),
    "manipulability": (ManipulabilityGradient(0.05),),
    "base": (BaseAttitudeHeld(1.0),),
    "both": (BaseAttitudeHeld(1.0), JointLimitAvoidance(5.0)),
}


@pytest.fixture(scope="module")
def arm(robots):
    robot = robots["servicer_7dof"]
    assert robot.num_joints == 7
    return robot


def displaced(robot, state, duration):
    position, quaternion = wu_path.tool_pose(robot, state)
    turn = rotation_vector_to_quaternion(jnp.array([0.1, -0.2, 0.1]))
    goal = np.asarray(position) + np.array([0.1, -0.15, 0.1]), quaternion_multiply(turn, quaternion)
    return wu_path.Straight.between((position, quaternion), goal, duration)


@pytest.fixture(scope="module")
def motions(arm):
    state = wu_path.state_at(POSTURE)
    path = displaced(arm, state, DURATION)
    run = jit(lambda t: track(arm, path, state, t, DURATION))
    return {name: run(dataclasses.replace(FOLLOW, secondary=tasks)) for name, tasks in TASKS.items()}


def limit_distance(robot, tracked):
    """Mean square of the joints' distance from the middle of their ranges, at the end."""
    lower, upper = robot.limits.position_lower, robot.limits.position_upper
    return float(
        np.mean(((tracked.motion.joint_position[-1] - (lower + upper) / 2) / ((upper - lower) / 2)) ** 2)
    )


def base_turn(tracked):
    return 2 * float(np.arccos(np.clip(np.min(np.abs(tracked.motion.base_quaternion[:, 0])), 0, 1)))


@pytest.mark.parametrize("name", [name for name in TASKS if name != "none"])
@pytest.mark.slow
def test_secondary_tasks_leave_the_tool_alone(motions, name):
    assert float(jnp.min(motions[name].singular_values)) > FOLLOW.epsilon
    without, found = pose_errors(motions["none"]), pose_errors(motions[name])
    assert float(found.position_end) < 2e-6
    assert float(found.attitude_end) < 2e-6
    assert float(found.position_peak) < max(1.5 * float(without.position_peak), 2e-4)
    moved = motions[name].motion.joint_position[-1] - motions["none"].motion.joint_position[-1]
    assert np.max(np.abs(moved)) > 1e-2


@pytest.mark.slow
def test_secondary_goals_improve(arm, motions):
    none = motions["none"]
    assert limit_distance(arm, motions["limits"]) < limit_distance(arm, none) - 1e-3
    # One direction of freedom for the three of the base: no more than a little can be had.
    assert base_turn(motions["base"]) < 0.98 * base_turn(none)


def test_priorities_rank(arm):
    """Three directions of the base in a null space of one leave nothing for the joint limits, which come second."""

    @jit
    def added(q):
        state = wu_path.state_at(POSTURE)
        state = dataclasses.replace(state, joint_position=q)
        kin = kinematics(arm, state)
        answer = response(arm, kin, jnp.asarray(MOMENTUM), None, "floating")
        situation = Situation(arm, state, kin, answer, state, jnp.asarray(MOMENTUM), None, "floating")
        damping = raised_cosine(0.02, 0.02)
        space, still = null_space(answer.jacobian, damping), jnp.zeros(7)
        limits, rest = JointLimitAvoidance(5.0)(situation, still, space, damping)
        base, left = BaseAttitudeHeld()(situation, still, space, damping)
        both, _ = JointLimitAvoidance(5.0)(situation, base, left, damping)
        apart, _ = BaseAttitudeHeld(decoupled=True)(situation, still, space, damping)
        climbed, _ = ManipulabilityGradient(1.0)(situation, still, jnp.eye(7), damping)
        return limits, base, both, apart, climbed, answer, space - rest

    limits, base, both, apart, climbed, answer, unused = added(POSTURE)
    assert np.max(np.abs(unused)) == 0
    assert np.max(np.abs(both - base)) < 1e-12
    assert np.max(np.abs(limits)) > 1e-3
    # Solved for in the null space or on its own and projected: the tool is left alone, the first turns the base less.
    turning = [np.linalg.norm(answer.base_twist(rates)[3:]) for rates in (jnp.zeros(7), base, apart)]
    assert turning[1] < 0.999 * turning[0]
    assert turning[1] <= turning[2] + 1e-15
    for rates in (limits, base, both, apart):
        np.testing.assert_allclose(answer.jacobian @ rates, 0.0, atol=1e-14)

    def log_manipulability(q):
        found = generalized_jacobian(
            arm, kinematics(arm, dataclasses.replace(wu_path.state_at(POSTURE), joint_position=q))
        )
        return 0.5 * np.linalg.slogdet(found @ found.T + 1e-4 * np.eye(6))[1]

    for joint in (1, 3):
        step = 1e-5 * np.eye(7)[joint]
        slope = (log_manipulability(POSTURE + step) - log_manipulability(POSTURE - step)) / 2e-5
        assert abs(float(climbed[joint]) - slope) < 1e-7


@pytest.mark.slow
def test_first_order_change_of_the_tool_is_none(arm, motions):
    """At the common start, what a secondary task adds to the rates moves joints, and does not move the tool."""
    kin = kinematics(arm, wu_path.state_at(POSTURE))
    jacobian = generalized_jacobian(arm, kin)
    for name in TASKS:
        added = motions[name].commanded_rate[0] - motions["none"].commanded_rate[0]
        np.testing.assert_allclose(jacobian @ added, 0.0, atol=1e-14)
        assert (np.max(np.abs(added)) > 1e-4) == (name != "none")


@pytest.fixture(scope="module")
def wu(robots):
    return robots["wu_2018_6dof"]


@pytest.mark.slow
def test_a_free_roll_and_a_free_attitude_give_a_six_axis_arm_freedom(wu):
    """The directions that are tracked are kept, and those that are not are used."""
    state = wu_path.state_at(wu_path.START)
    path = displaced(wu, state, DURATION)
    for freedom, directions in (("roll_free", 5), ("position", 3)):
        tracker = dataclasses.replace(FOLLOW, freedom=freedom, secondary=(BaseAttitudeHeld(2.0, 1e-4),))
        found = jit(lambda t: track(wu, path, state, t, DURATION))(tracker)
        assert found.singular_values.shape[1] == directions
        errors = pose_errors(found)
        assert float(errors.position_end) < 2e-6
        assert float(errors.attitude_end) > 1e-3
        # Three directions of the tool leave three for the base: it keeps its attitude altogether.
        assert freedom != "position" or base_turn(found) < 1e-5
        pointing = pointing_error(found.tool_quaternion[-1], found.target_quaternion[-1])
        tilt = float(jnp.linalg.norm(pointing))
        assert tilt < 2e-6 if freedom == "roll_free" else tilt > 1e-3


def test_pointing_error_is_the_shortest_turn_of_the_axis():
    rng = np.random.default_rng(0)
    for size in (1e-9, 1e-5, 0.4, 3.0):
        goal = rng.normal(size=4)
        goal /= np.linalg.norm(goal)
        across, roll = rng.normal(size=3), rng.normal()
        across[2] = 0.0
        across *= size / np.linalg.norm(across)
        inner = quaternion_multiply(
            rotation_vector_to_quaternion(jnp.asarray(across)),
            rotation_vector_to_quaternion(jnp.array([0, 0, roll])),
        )
        found = pointing_error(quaternion_multiply(jnp.asarray(goal), inner), jnp.asarray(goal))
        assert abs(float(jnp.linalg.norm(found)) - size) < 1e-12 + 1e-9 * size
    slope = jax.jacobian(pointing_error)(jnp.array([1.0, 0, 0, 0]), jnp.array([1.0, 0, 0, 0]))
    np.testing.assert_allclose(slope[:2, 1:3], 2 * np.eye(2), atol=1e-12)
