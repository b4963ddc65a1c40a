"""The tracked motion itself: against closed forms, MuJoCo, a finer run by other code; in batches; what is refused."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.crosscheck.compare import attitude_difference
from jffsr.crosscheck.drive import make_drive
from jffsr.crosscheck.mujoco_run import run_mujoco
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.loading import describe_robot
from jffsr.robots.robot import Limits
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.tracking.held_rates import HeldRates
from jffsr.tracking.indices import pose_errors
from jffsr.tracking.outcome import TrackingCode, TrackingTolerances, check_path, outcome
from jffsr.tracking.reach import inside_base, reach
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track
from jffsr.tracking.verification import verify_tracking
from jffsr.trajectories.cartesian.interface import ToolTarget

MOMENTUM = np.array([0.4, -0.3, 0.2, 0.5, -0.6, 0.3])
TUMBLED = np.array([0.8, -0.2, 0.4, 0.4])
START = wu_path.state_at(wu_path.START, (0.3, -1.0, 2.0), TUMBLED / np.linalg.norm(TUMBLED))
EXACT = Tracker(method="inverse", substeps=5, feedforward="mean", position_gain=10.0, attitude_gain=10.0)
DURATION = 5.0


@pytest.fixture(scope="module")
def wu(robots):
    return robots["wu_2018_6dof"]


@pytest.fixture(scope="module")
def short_path(wu):
    """Far from singularities: 15 cm and 9 degrees."""
    position, quaternion = wu_path.tool_pose(wu, START)
    turn = rotation_vector_to_quaternion(jnp.array([0.1, -0.05, 0.1]))
    goal = np.asarray(position) + np.array([0.05, 0.1, -0.1]), quaternion_multiply(turn, quaternion)
    return wu_path.Straight.between((position, quaternion), goal, DURATION)


@pytest.fixture(scope="module")
def follow(wu, short_path):
    return jit(lambda tracker, momentum: track(wu, short_path, START, tracker, DURATION, momentum))


@pytest.fixture(scope="module")
def tracked(follow):
    return follow(EXACT, MOMENTUM)


@pytest.fixture(scope="module")
def check():
    return jit(lambda robot, tracked: verify_tracking(robot, tracked, num_steps=8))


@pytest.fixture(scope="module")
def verified(wu, tracked, check):
    return check(wu, tracked)


def test_feedback_with_substeps_ends_where_the_path_does(tracked):
    """At 0.25 s sampling, with momentum, below 1e-6 m and rad; the singular values stay far from zero."""
    errors = pose_errors(tracked)
    assert float(jnp.min(tracked.singular_values)) > 0.1
    assert float(errors.position_end) < 1e-6
    assert float(errors.attitude_end) < 1e-6
    assert float(errors.position_peak) < 1e-4


def test_the_tool_moves_as_it_is_told_under_momentum(short_path, wu, tracked):
    """Rates by differences: J* qd + H* G is the target's mean twist plus the fed back error."""
    motion = tracked.motion
    step = float(motion.time[1])
    for k in (0, 33):
        twist, rate = np.asarray(motion.base_twist[k]), np.asarray(motion.joint_velocity[k])

        def position(shift, k=k, twist=twist, rate=rate):
            turned = rotation_vector_to_quaternion(jnp.asarray(shift * twist[3:]))
            moved = wu_path.state_at(
                motion.joint_position[k] + shift * rate,
                motion.base_position[k] + shift * twist[:3],
                quaternion_multiply(turned, motion.base_quaternion[k]),
            )
            return np.asarray(wu_path.tool_pose(wu, moved)[0])

        velocity = (position(1e-4) - position(-1e-4)) / 2e-4
        now, later = (short_path(motion.time[k] + shift).position for shift in (0.0, step))
        asked = (later - now) / step - EXACT.position_gain * (tracked.tool_position[k] - now)
        np.testing.assert_allclose(velocity, asked, atol=1e-8)


def test_verified_by_a_finer_run_of_other_code(wu, tracked, verified):
    assert float(verified.position_difference) < 1e-10
    assert float(verified.attitude_difference) < 1e-10
    assert float(verified.tool_position_difference) < 1e-10
    assert 0 < float(verified.momentum_drift) < 1e-8
    assert abs(float(verified.position_error) - float(pose_errors(tracked).position_peak)) < 1e-9
    result = outcome(wu, tracked, verified)
    assert result.success
    assert "kept" in result.sentence


def test_verification_sees_a_wrong_robot_and_a_wrong_pose(wu, tracked, check):
    heavier = wu.replace(mass=wu.mass * np.array([1.0, 1, 1, 1, 1, 1, 1.1]))
    wrong = check(heavier, tracked)
    assert float(wrong.position_difference) > 1e-5
    assert outcome(wu, tracked, wrong).code is TrackingCode.NOT_VERIFIED
    moved = dataclasses.replace(tracked, tool_position=tracked.tool_position + 1e-4)
    assert abs(float(check(wu, moved).tool_position_difference) - 1e-4 * np.sqrt(3)) < 1e-8


def test_mujoco_goes_the_same_way(wu, tracked):
    """Driven by joint torques alone along the tracked joints, interval ends compared."""
    motion = jax.device_get(tracked.motion)
    trajectory = HeldRates(jnp.asarray(motion.joint_position[:26]), jnp.asarray(motion.time[25]))
    drive = make_drive(wu, trajectory, START, motion.time[:26], 2e-3, MOMENTUM)
    engine = run_mujoco(wu, drive)
    assert np.max(np.linalg.norm(engine.base_position - motion.base_position[:26], axis=-1)) < 1e-6
    assert np.max(attitude_difference(engine.base_quaternion, motion.base_quaternion[:26])) < 1e-6
    # Of a motion of millimetres, on a base of 450 kg.
    assert np.linalg.norm(motion.base_position[25] - motion.base_position[0]) > 1e-3


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True)
class Arc:
    """A target that goes round the origin; only its position and linear velocity are used."""

    radius: jax.Array
    start: jax.Array
    rate: jax.Array

    def __call__(self, time):
        angle = self.start + self.rate * time
        ahead = jnp.array([jnp.cos(angle), jnp.sin(angle), 0.0])
        along = jnp.array([-jnp.sin(angle), jnp.cos(angle), 0.0])
        twist = jnp.concatenate([self.radius * self.rate * along, jnp.zeros(3)])
        return ToolTarget(self.radius * ahead, jnp.array([1.0, 0, 0, 0]), twist, jnp.zeros(6))


def test_one_link_turns_its_base_as_the_closed_form_says():
    """Base and one link in a plane: the base's angle is a function of the joint's alone."""
    whole = describe_robot("hu_2011_planar2")
    tool = dataclasses.replace(whole.end_effectors[0], link=whole.links[1].name)
    robot = build_robot(
        dataclasses.replace(
            whole, links=whole.links[:2], joints=whole.joints[:1], end_effectors=(tool,), shapes=()
        )
    )
    m0, m1, i0, i1, r0, l1 = 400.0, 40.0, 66.67, 3.33, 0.5, 0.5
    mu = m0 * m1 / (m0 + m1)
    a, b, c = i1 + mu * l1**2, mu * r0 * l1, i0 + mu * r0**2
    root = np.sqrt((a + c) ** 2 - 4 * b**2)

    def closed(q):
        turn = np.arctan(np.sqrt((a + c + 2 * b) / (a + c - 2 * b)) ** -1 * np.tan(q / 2))
        return -q / 2 - (a - c) / root * (turn + np.pi * np.round(q / (2 * np.pi)))

    target = Arc(*(jnp.asarray(x) for x in (1.4, 0.4, 0.12)))
    tracker = Tracker(method="damped", damping=0.1, freedom="position", substeps=2)
    found = jit(lambda: track(robot, target, wu_path.state_at([0.4]), tracker, 10.0))()
    q = np.asarray(found.motion.joint_position[:, 0])
    w, _, _, z = np.asarray(found.motion.base_quaternion).T
    assert abs(q[-1] - q[0]) > 0.5
    np.testing.assert_allclose(2 * np.arctan2(z, w), closed(q) - closed(q[0]), atol=1e-9)
    assert found.determinant is None


@pytest.fixture(scope="module")
def planar(robots):
    """Paper 001's arm along an arc; the tracker, the momentum and, static, how the base is held are arguments."""
    robot, start = robots["hu_2011_planar2"], wu_path.state_at([0.3, 1.4])
    position = np.asarray(wu_path.tool_pose(robot, start)[0])
    polar = np.linalg.norm(position), np.arctan2(position[1], position[0]), 0.1
    target = Arc(*(jnp.asarray(x) for x in polar))

    def follow(tracker, momentum, base_mode="floating"):
        return track(robot, target, start, tracker, 3.0, momentum, base_mode=base_mode)

    return follow


PLANAR = dataclasses.replace(EXACT, freedom="position", limits="ignore")


def test_a_fixed_base_stands_still_and_the_tool_follows(planar):
    held = jit(lambda: planar(PLANAR, MOMENTUM, "fixed"))()
    np.testing.assert_array_equal(held.motion.base_position, np.zeros_like(held.motion.base_position))
    # The target is still moving, at 0.2 m/s: what is left is the curvature of a step of 0.05 s.
    assert float(pose_errors(held).position_peak) < 2e-4


@pytest.mark.slow
def test_a_batch_of_trackers_and_momenta_is_each_of_them(planar):
    gains = jnp.linspace(0.0, 5.0, 1000)
    trackers = dataclasses.replace(PLANAR, position_gain=gains)
    momenta = jnp.asarray(np.random.default_rng(0).normal(size=(1000, 1)) * [1.0, -1.0, 0, 0, 0, 2.0])
    axes = dataclasses.replace(jax.tree.map(lambda _: None, PLANAR), position_gain=0)
    many = jit(jax.vmap(planar, in_axes=(axes, 0)))(trackers, momenta)
    assert many.pose_error.shape == (1000, 61, 6)
    one = jit(planar)
    for k in (0, 333, 999):
        found = one(dataclasses.replace(PLANAR, position_gain=gains[k]), momenta[k])
        np.testing.assert_allclose(many.pose_error[k], found.pose_error, atol=1e-11)
        np.testing.assert_allclose(many.motion.base_position[k], found.motion.base_position, atol=1e-11)
    assert np.ptp(np.asarray(many.pose_error[:, -1, 0])) > 1e-6


def test_reach_bounds_every_posture(robots, wu):
    rng = np.random.default_rng(0)
    for name in ("wu_2018_6dof", "hu_2011_planar2"):
        robot = robots[name]
        longest = reach(robot)
        far = 0.0
        for _ in range(60):
            state = wu_path.state_at(rng.uniform(-np.pi, np.pi, robot.num_joints))
            tool = np.asarray(wu_path.tool_pose(robot, state)[0])
            centre = np.asarray(wu_path.centre_of_mass(robot, state))
            far = max(far, np.linalg.norm(tool - centre))
        assert 0.5 * longest < far <= longest
    # The planar arm laid out: 1.0 m from the last joint inwards to each body's own centre of mass.
    robot = robots["hu_2011_planar2"]
    m = np.asarray(robot.mass)
    assert abs(reach(robot) - m @ [2.5, 1.5, 0.5] / m.sum()) < 1e-12
    assert abs(reach(robot, base_mode="fixed") - 2.5) < 1e-12


def test_unreachable_paths_and_paths_through_the_base_are_told(wu, tracked, verified):
    time, points = np.array([0.0, 1.0, 2.0]), np.array([[1.5, 0, 0.5], [2.5, 0, 0.5], [9.0, 0, 0.5]])
    start = wu_path.state_at(wu_path.START)
    assert check_path(wu, time[:2], points[:2], start) is None
    found = check_path(wu, time, points, start)
    assert found.code is TrackingCode.UNREACHABLE
    assert "at 2 s" in found.sentence
    found = check_path(wu, time, points[:1] * [0.1, 1, 0.2] + np.zeros((3, 3)), start)
    assert found.code is TrackingCode.THROUGH_BASE
    box = np.array([[0.7, 0, 0], [0.7, 0.7, 0.7], [0.8, 0, 0], [0, 0, -0.76]])
    turned = np.broadcast_to(np.eye(3), (4, 3, 3))
    np.testing.assert_array_equal(inside_base(wu, np.zeros(3), turned, box), [True, True, False, False])
    through = dataclasses.replace(
        tracked, target_position=tracked.target_position.at[40].set(tracked.motion.base_position[40])
    )
    assert outcome(wu, through, verified).code is TrackingCode.THROUGH_BASE


def test_outcomes_name_what_went_wrong(wu, tracked, verified):
    tight = TrackingTolerances(position=1e-9, attitude=1e-9)
    lost = outcome(wu, tracked, verified, tight)
    assert lost.code is TrackingCode.LOST_PATH
    over = dataclasses.replace(verified, rate_overrun=verified.rate_overrun.at[2].set(0.25))
    exceeded = outcome(wu, tracked, over)
    assert exceeded.code is TrackingCode.LIMITS_EXCEEDED
    assert "rate of joint3 by 25 %" in exceeded.sentence
    broken = dataclasses.replace(tracked, pose_error=tracked.pose_error * jnp.nan)
    assert outcome(wu, broken, verified).code is TrackingCode.NOT_FINITE


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"method": "adaptiv"}, "did you mean 'adaptive'"),
        ({"limits": "clip"}, "allowed are ignore, scale, redistribute"),
        ({"substeps": 0}, "positive whole number"),
        ({"period": -0.1}, "positive and finite"),
        ({"epsilon": 0.0}, "epsilon is 0; it must be positive"),
        ({"lambda_max": -1.0}, "lambda_max is -1; it must be zero or positive"),
        ({"position_gain": 50.0}, "unstable"),
        ({"period": 0.3}, "whole number of periods"),
    ],
)
def test_what_makes_no_sense_is_refused(wu, short_path, changes, words):
    with pytest.raises(InputError, match=words):
        track(wu, short_path, START, dataclasses.replace(EXACT, **changes), DURATION)


def test_a_start_outside_the_joint_limits_is_refused(wu, short_path):
    tight = wu.replace(limits=Limits.symmetric(6, position=np.deg2rad(180.0)))
    with pytest.raises(
        InputError, match=r"joint5 starts at 210 deg, outside its limits of \[-180, 180\] deg"
    ):
        track(tight, short_path, START, EXACT, DURATION)
    contradicting = wu.replace(limits=Limits(np.ones(6), -np.ones(6), *(np.ones(6),) * 3))
    with pytest.raises(InputError, match="joint1 has the limits"):
        track(contradicting, short_path, START, EXACT, DURATION)
