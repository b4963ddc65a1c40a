"""Joint limits held at and between samples, by scaling the task or by letting other joints take over."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import wu_path
from scipy.optimize import linprog

from jffsr.compiling import jit
from jffsr.robots.robot import Limits
from jffsr.tracking.damping import constant
from jffsr.tracking.limits import rate_bounds, redistributed, scaled
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track

STEP = 0.25


def limits(n=1, **changes):
    return replace(Limits.symmetric(n), **{name: np.full(n, float(x)) for name, x in changes.items()})


def test_rate_bounds_are_the_nearest_of_all_limits():
    q, rate = np.array([0.9, 0.0, -0.95]), np.array([0.0, 0.1, 0.0])
    held = Limits.symmetric(3, position=1.0, velocity=0.3)
    lower, upper = rate_bounds(held, q, rate, STEP)
    np.testing.assert_allclose(upper, [0.3, 0.3, 0.3])
    np.testing.assert_allclose(lower, [-0.3, -0.3, -0.2])
    held = Limits.symmetric(3, velocity=0.3, acceleration=0.4)
    lower, upper = rate_bounds(held, q, rate, STEP)
    np.testing.assert_allclose(upper, [0.1, 0.2, 0.1])
    np.testing.assert_allclose(lower, [-0.1, 0.0, -0.1])


def test_a_joint_driven_at_its_limit_brakes_in_time():
    """As fast as the bounds allow from any start: the limit is met, never passed, and no bound contradicts another."""
    acceleration, change = 0.4, 0.4 * STEP
    held = limits(position_upper=1.0, velocity=0.7, acceleration=acceleration)
    bounds = jax.jit(lambda q, rate: rate_bounds(held, q, rate, STEP))
    for start in (-1.3, -0.2, 0.37):
        q, rate = np.array([start]), np.zeros(1)
        for _ in range(40):
            lower, upper = bounds(q, rate)
            assert upper >= rate - change - 1e-12
            assert lower <= upper
            rate = np.asarray(upper)
            q = q + STEP * rate
            assert q <= 1 + 1e-12
        np.testing.assert_allclose(q, 1.0, atol=1e-9)


def test_scaling_keeps_the_direction_and_goes_as_far_as_it_can():
    task, rest = np.array([1.0, -2.0, 0.1]), np.array([0.1, 0.0, 0.0])
    bound = np.array([0.5, 0.6, 1.0])
    found = scaled(task, rest, -bound, bound)
    assert abs(float(found.share) - 0.3) < 1e-15
    np.testing.assert_allclose(found.rates, rest + 0.3 * task, atol=1e-15)
    assert float(scaled(task, rest, -9 * bound, 9 * bound).share) == 1.0
    # What is wanted beside the task is cut off where it alone is too much.
    found = scaled(task, 10 * rest, -bound, bound)
    assert float(found.share) == 0.0
    np.testing.assert_allclose(found.rates, [0.5, 0.0, 0.0])


def largest_share(jacobian, velocity, bound):
    """The largest share of a task that any rates inside the bounds perform, by linear programming."""
    m, n = jacobian.shape
    found = linprog(
        np.append(np.zeros(n), -1.0),
        A_eq=np.hstack([jacobian, -velocity[:, None]]),
        b_eq=np.zeros(m),
        bounds=[*((-b, b) for b in bound), (0, 1)],
    )
    return found.x[-1]


def test_redistribution_does_the_whole_task_where_that_is_possible():
    rng, solve = np.random.default_rng(0), jax.jit(redistributed)
    better = whole = 0
    for _ in range(60):
        jacobian, velocity = rng.normal(size=(3, 6)), rng.normal(size=3)
        bound = rng.uniform(0.1, 0.8, 6)
        found = solve(jacobian, velocity, np.zeros(3), np.zeros(6), -bound, bound, constant(0.0))
        rates, share = np.asarray(found.rates), float(found.share)
        assert np.all(np.abs(rates) <= bound)
        np.testing.assert_allclose(jacobian @ rates, share * velocity, atol=1e-9)
        possible = largest_share(jacobian, velocity, bound)
        plain = float(scaled(np.linalg.pinv(jacobian) @ velocity, np.zeros(6), -bound, bound).share)
        assert plain - 1e-9 <= share <= possible + 1e-9
        better += share > plain + 1e-6
        whole += possible == 1.0 and share == 1.0 and plain < 1
    assert better > 30
    assert whole > 3


def test_redistribution_makes_up_for_drift_first():
    rng = np.random.default_rng(1)
    jacobian, velocity, drift = rng.normal(size=(3, 6)), rng.normal(size=3), 0.1 * rng.normal(size=3)
    bound = np.full(6, 0.25)
    found = redistributed(jacobian, velocity, drift, np.zeros(6), -bound, bound, constant(0.0))
    assert 0 < float(found.share) < 1
    np.testing.assert_allclose(jacobian @ found.rates + drift, found.share * velocity, atol=1e-9)


@pytest.fixture(scope="module")
def limited(robots):
    """Wu's arm with limits that the published path meets, and its motion under each rule."""
    robot = robots["wu_2018_6dof"]
    start = wu_path.START
    position = np.deg2rad(400.0) * np.ones(6)
    upper = position.copy()
    upper[1] = start[1] + np.deg2rad(6.0)
    held = Limits(-position, upper, np.deg2rad(4.0) * np.ones(6), np.deg2rad(3.0) * np.ones(6), position)
    robot = robot.replace(limits=held)
    path = wu_path.wu_path(robot, 15.0)
    tracker = Tracker(lambda_max=0.0571, epsilon=0.0677, position_gain=0.5, attitude_gain=0.5)
    run = jit(lambda t: track(robot, path, wu_path.state_at(start), t, 15.0))
    return robot, {rule: run(replace(tracker, limits=rule)) for rule in ("scale", "redistribute")}


@pytest.mark.parametrize("rule", ["scale", "redistribute"])
def test_limits_hold_at_and_between_samples(limited, rule):
    robot, motions = limited
    tracked, held = motions[rule], robot.limits
    grid = tracked.motion.joint_grid
    assert np.all(np.abs(grid.joint_velocity) <= held.velocity * (1 + 1e-12))
    assert np.all(np.abs(grid.joint_acceleration) <= held.acceleration * (1 + 1e-9))
    assert np.all(grid.joint_position <= held.position_upper + 1e-12)
    assert np.all(grid.joint_position >= held.position_lower - 1e-12)
    # The positions are those of the rates: straight between the samples.
    q, rates = np.asarray(tracked.motion.joint_position), np.asarray(tracked.motion.joint_velocity)
    np.testing.assert_allclose(np.diff(q, axis=0), STEP * rates[:-1], atol=1e-13)
    assert np.any(tracked.limited)
    assert not np.all(tracked.limited)
    free = ~np.asarray(tracked.limited)
    np.testing.assert_array_equal(np.asarray(tracked.commanded_rate)[free][:-1], rates[free][:-1])


def test_the_rules_had_something_to_do(limited):
    robot, motions = limited
    tracked, held = motions["scale"], robot.limits
    assert np.any(np.abs(tracked.commanded_rate) > held.velocity)
    change = np.diff(np.asarray(tracked.commanded_rate), axis=0) / STEP
    assert np.any(np.abs(change) > held.acceleration)
    assert np.max(tracked.motion.joint_position[:, 1]) > held.position_upper[1] - 1e-3
    assert np.any(tracked.share < 1)


def test_gradients_under_infinite_limits_are_finite():
    free = Limits.symmetric(2)

    def total(step):
        lower, upper = rate_bounds(free, jnp.ones(2), jnp.zeros(2), step)
        return jnp.sum(scaled(jnp.ones(2) * step, jnp.zeros(2), lower, upper).rates)

    assert float(jax.grad(total)(0.1)) == 2.0
