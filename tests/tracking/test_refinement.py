"""A tracked motion refined as a whole: derivatives, limits, a closed form, and errors between the samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.robots.state import State
from jffsr.spatial.rotation import rotation_vector_to_quaternion
from jffsr.tracking.between_samples import errors_between
from jffsr.tracking.refinement import errors_linearised, rates_followed, refine_tracking
from jffsr.tracking.retimed import Retimed
from jffsr.tracking.tool_task import ALL
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track, track_rates
from jffsr.trajectories.cartesian.interface import ToolTarget

SAMPLES, DURATION = 8, 2.0
# Half a degree from the wrist's singularity, which the short way crosses.
NEAR = np.deg2rad([178, -25, -68, -20, 180.5, 23])
MOMENTUM = np.array([0.3, -0.2, 0.1, 0.2, 0.1, -0.3])
SCALES = {"position_scale": 0.001, "attitude_scale": 0.004}


@pytest.fixture(scope="module")
def wu(robots):
    return robots["wu_2018_6dof"]


@pytest.fixture(scope="module")
def path(wu):
    """A short straight way with a turn that joints 4 and 6 would have to make half a turn for."""
    position, quaternion = wu_path.tool_pose(wu, wu_path.state_at(NEAR))
    turn = jnp.array([0.01, -0.03, 0.02])
    return wu_path.Straight(
        position, quaternion, position + jnp.array([0.01, 0.01, -0.05]), turn, jnp.asarray(DURATION), 0.2
    )


@pytest.fixture(scope="module")
def tracked(wu, path):
    tracker = Tracker(lambda_max=0.0571, epsilon=0.0677)
    return jit(
        lambda p: track(wu, p, wu_path.state_at(NEAR), tracker, momentum=MOMENTUM, num_samples=SAMPLES)
    )(path)


@pytest.fixture(scope="module")
def limit(tracked):
    return float(jnp.max(jnp.abs(tracked.motion.joint_velocity)))


@pytest.fixture(scope="module")
def refined(wu, path, tracked, limit):
    return refine_tracking(wu, path, tracked, rate_limit=limit, iterations=12, **SCALES)


def largest(error, position_scale, attitude_scale):
    """The largest length of either part over its scale."""
    position, attitude = (np.linalg.norm(part, axis=1).max() for part in np.split(np.asarray(error), 2, 1))
    return max(position / position_scale, attitude / attitude_scale)


def followed(wu, path, rates, own_time):
    """The motion of these rates, by the program that refinement compiles."""
    target = Retimed(path, np.asarray(own_time), np.asarray(DURATION))
    start = wu_path.state_at(NEAR)
    return rates_followed(
        wu, target, start, np.asarray(rates), np.asarray(DURATION), MOMENTUM, None, "floating"
    )


def test_given_rates_make_the_tracked_motion_again(wu, path, tracked):
    again = followed(wu, path, tracked.motion.joint_velocity[:-1], tracked.time)
    for part in ("motion", "pose_error", "singular_values", "target_twist"):
        both = (jax.tree.leaves(getattr(x, part)) for x in (again, tracked))
        for found, expected in zip(*both, strict=True):
            np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.slow
def test_derivatives_of_the_errors_agree_with_differences(wu, path, tracked):
    rates = tracked.motion.joint_velocity[:-1]
    # Not on a kink of the trapezoid, where the twist's derivative jumps.
    own_time = tracked.time * 0.97 + 0.013
    at = followed(wu, path, rates, tracked.time)
    found, by_rates, by_time = errors_linearised(wu, path, np.asarray(own_time), at, ALL, None)

    def errors(rates, own_time):
        return followed(wu, path, rates, own_time).pose_error[1:]

    np.testing.assert_allclose(found, errors(rates, own_time), atol=1e-12)
    size = 1e-5
    for k, joint in ((0, 3), (2, 0), (5, 5), (7, 1)):
        step = np.zeros(rates.shape)
        step[k, joint] = size
        slope = (errors(rates + step, own_time) - errors(rates - step, own_time)) / (2 * size)
        np.testing.assert_allclose(by_rates[:, :, k, joint], slope, atol=1e-8)
        assert np.max(np.abs(slope[k])) > 0.01
    step = size * jnp.ones(SAMPLES + 1)
    slope = (errors(rates, own_time + step) - errors(rates, own_time - step)) / (2 * size)
    np.testing.assert_allclose(by_time, slope, atol=1e-8)


def test_the_error_falls_at_the_same_peak_rate(path, tracked, refined, limit):
    assert largest(tracked.pose_error, *SCALES.values()) == pytest.approx(refined.worst[0])
    assert largest(refined.tracked.pose_error, *SCALES.values()) == pytest.approx(refined.worst[-1])
    assert refined.worst[-1] < 0.6 * refined.worst[0]
    assert np.all(np.diff(refined.worst) <= 0)
    assert np.max(np.abs(refined.tracked.motion.joint_velocity)) <= limit * (1 + 1e-12)
    assert refined.target is path


def test_the_pace_may_be_refined_as_well(wu, tracked, path, limit):
    found = refine_tracking(wu, path, tracked, rate_limit=limit, retime=True, iterations=12, **SCALES)
    own = np.asarray(found.target.own_time)
    assert own[0] == 0
    assert own[-1] == DURATION
    assert np.all(np.diff(own) >= -1e-12)
    assert not np.allclose(own, tracked.time)
    assert found.worst[-1] < 0.7 * found.worst[0]
    targets = jax.vmap(lambda t: path(t).position)(own)
    np.testing.assert_allclose(found.tracked.target_position, targets, atol=1e-12)


def test_twist_of_a_retimed_target_is_its_velocity(path):
    retimed = Retimed(path, jnp.array([0.0, 0.2, 1.5, 2.0]), jnp.asarray(DURATION))
    for time in (0.3, 0.9, 1.7):
        now, step = retimed(jnp.asarray(time)), 1e-6
        velocity = (retimed(time + step).position - retimed(time - step).position) / (2 * step)
        np.testing.assert_allclose(now.twist[:3], velocity, atol=1e-8)


def test_limits_of_acceleration_and_position_are_kept(wu, path, tracked, limit):
    free = refine_tracking(wu, path, tracked, rate_limit=limit, iterations=6, **SCALES).tracked.motion
    high = np.asarray(free.joint_position).max(0)
    upper = NEAR + 0.5 * (high - NEAR) + 1e-3
    held = replace(wu, limits=replace(wu.limits, position_upper=upper))
    # From rest, the first change of the given motion is larger than the limit.
    change = np.asarray(tracked.motion.joint_acceleration)
    most = 0.5 * np.abs(change).max()
    found = refine_tracking(
        held, path, tracked, rate_limit=limit, acceleration_limit=most, iterations=6, **SCALES
    ).tracked.motion
    assert np.max(np.asarray(free.joint_position) - upper) > 0.01
    allowed = np.maximum(upper, np.asarray(tracked.motion.joint_position))
    assert np.max(np.asarray(found.joint_position) - allowed) < 1e-9
    rates = np.concatenate([np.zeros((1, 6)), np.asarray(found.joint_velocity)[:-1], np.zeros((1, 6))])
    given = np.concatenate(
        [np.zeros((1, 6)), np.asarray(tracked.motion.joint_velocity)[:-1], np.zeros((1, 6))]
    )
    step = DURATION / SAMPLES
    assert np.all(
        np.abs(np.diff(rates, axis=0)) <= np.maximum(most * step, np.abs(np.diff(given, axis=0))) + 1e-9
    )


ANGLES = np.array([0.0, 0.05, 0.2, 0.6, 1.0, 1.4, 1.55, 1.6])


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TurnTarget:
    """A turn about z that is too fast on its way."""

    def __call__(self, time):
        turn = jnp.array([0.0, 0.0, 1.0]) * jnp.interp(time, jnp.arange(8.0), ANGLES)
        return ToolTarget(jnp.zeros(3), rotation_vector_to_quaternion(turn), jnp.zeros(6), jnp.zeros(6))


@pytest.mark.slow
def test_least_largest_error_of_a_turn_that_is_too_fast(robots):
    """On a fixed base two parallel joints turn the tool at most twice as fast as one. A motion slower than r that is
    never off by more than e needs e >= (x_j - x_i - r (t_j - t_i))/2 for all i < j, and those that start on time
    e >= x_j - r t_j; there is one that needs no more."""
    robot, rate = robots["hu_2011_planar2"], 0.14
    start = State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(2))
    rest = jit(lambda r: track_rates(robot, TurnTarget(), start, r, 7.0, base_mode="fixed"))(
        jnp.full((7, 2), 0.5 * rate)
    )
    found = refine_tracking(
        robot, TurnTarget(), rest, rate_limit=rate, position_scale=1e6, attitude_scale=1.0, iterations=12
    )
    x, t = ANGLES, np.arange(8.0)
    late = [0.5 * (x[j] - x[i] - 2 * rate * (t[j] - t[i])) for j in range(8) for i in range(j)]
    expected = max([*late, *(x - 2 * rate * t)])
    assert expected > 0.05
    assert found.worst[-1] == pytest.approx(expected, abs=1e-7)


@pytest.mark.slow
def test_away_from_singularities_nothing_is_left_at_the_samples(wu):
    start = wu_path.state_at(wu_path.START)
    whole = wu_path.wu_path(wu, 25.0)
    path = replace(
        whole, goal=whole.start + 0.1 * (whole.goal - whole.start), turn=0.1 * whole.turn, duration=2.0
    )
    tracker = Tracker(lambda_max=0.0571, epsilon=0.0677)
    tracked = jit(lambda p: track(wu, p, start, tracker, num_samples=SAMPLES))(path)
    found = refine_tracking(wu, path, tracked, **SCALES)
    assert found.worst[0] > 0.1
    assert np.max(np.abs(found.tracked.pose_error)) < 1e-9


@pytest.mark.slow
def test_errors_between_samples_are_those_of_more_samples(wu, path, tracked):
    time, errors = jit(lambda t, p: errors_between(wu, p, t, num_steps=2))(tracked, path)
    twice = jit(lambda p, r: track_rates(wu, p, wu_path.state_at(NEAR), r, DURATION, MOMENTUM))(
        path, jnp.repeat(tracked.motion.joint_velocity[:-1], 2, axis=0)
    )
    np.testing.assert_allclose(time, twice.time, atol=1e-14)
    np.testing.assert_allclose(errors, twice.pose_error, atol=1e-8)
    np.testing.assert_allclose(errors[::2], tracked.pose_error, atol=1e-8)


def test_what_is_refused(wu, path, tracked):
    with pytest.raises(InputError, match="rate_limit is -1; it must be positive"):
        refine_tracking(wu, path, tracked, rate_limit=-1.0)
    with pytest.raises(InputError, match="position_scale is 0; it must be positive and finite"):
        refine_tracking(wu, path, tracked, position_scale=0.0)
    with pytest.raises(InputError, match="freedom is 'roll'; allowed are all, roll_free, position"):
        refine_tracking(wu, path, tracked, freedom="roll")
    with pytest.raises(InputError, match=r"rates have the shape \(5, 2\); \(K, 6\)"):
        track_rates(wu, path, wu_path.state_at(NEAR), np.zeros((5, 2)), 1.0)
