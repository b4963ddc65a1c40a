"""Clamped B-splines: SciPy's numbers, rest at the ends, hull, least duration, gradients, refusals."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.interpolate import BSpline

from jffsr.errors import InputError
from jffsr.trajectories.bspline import ClampedBSpline
from jffsr.trajectories.interface import PlannedTrajectory

START, GOAL = np.array([-1.5, 1.2, 0.3]), np.array([2.5, -0.5, 3.9])
DURATION = 7.0
SIZES = [(3, 7, True), (4, 8, True), (4, 8, False), (4, 5, False), (5, 12, True)]


def random_spline(degree=4, count=8, goal=True, **keywords):
    law = ClampedBSpline.between(START, GOAL if goal else None, DURATION, degree, count, **keywords)
    inner = np.random.default_rng(count).uniform(-3, 3, law.inner.shape)
    return replace(law, inner=inner)


@jax.jit
def sample(law, times):
    return law.on_grid(times)


@pytest.mark.parametrize(("degree", "count", "goal"), SIZES)
def test_position_rate_and_acceleration_are_scipys(degree, count, goal):
    """At random times, at every knot and at both ends: the last span is closed."""
    law = random_spline(degree, count, goal)
    assert law.control_points.shape == (count, 3)
    peer = BSpline(law.knots, np.asarray(law.control_points), degree)
    s = np.concatenate([np.unique(law.knots), np.random.default_rng(1).uniform(0, 1, 40), [1 - 1e-15]])
    found = sample(law, s * DURATION)
    for order, values in enumerate(found):
        expected = peer(s * DURATION / DURATION, nu=order).T / DURATION**order
        size = max(1, np.max(np.abs(expected)))
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12 * size)
        if order < 2:
            # Its own derivative by central differences, away from SciPy.
            # At a knot the acceleration of a cubic has a corner.
            middle, h = np.linspace(0.53, 6.47, 12), 1e-5
            ahead, behind = (sample(law, middle + step)[order] for step in (h, -h))
            rate = sample(law, middle)[order + 1]
            np.testing.assert_allclose((ahead - behind) / (2 * h), rate, rtol=0, atol=1e-6)


def test_knots_are_clamped_and_uniform_inside():
    np.testing.assert_allclose(
        random_spline(4, 8).knots, [0] * 5 + [0.25, 0.5, 0.75] + [1] * 5, rtol=0, atol=1e-16
    )


def test_both_ends_are_at_rest_or_only_the_start():
    for goal in (True, False):
        law = random_spline(4, 8, goal)
        at_start, at_end = law(0.0), law(DURATION)
        np.testing.assert_allclose(at_start[0], START, rtol=0, atol=1e-14)
        np.testing.assert_allclose(at_start[1:], 0, rtol=0, atol=1e-13)
        if goal:
            np.testing.assert_allclose(at_end[0], GOAL, rtol=0, atol=1e-14)
            np.testing.assert_allclose(at_end[1:], 0, rtol=0, atol=1e-13)
            assert law.boundary()[1].position is law.goal
        else:
            assert law.inner.shape == (5, 3)
            assert law.boundary()[1] == (None, None, None)
            np.testing.assert_allclose(at_end[0], law.inner[-1], rtol=0, atol=1e-14)
            assert np.min(np.abs(at_end[1])) > 0.1


@pytest.mark.parametrize(("degree", "count", "goal"), SIZES)
def test_a_start_under_way_has_the_rate_and_acceleration_asked_for(degree, count, goal):
    rate, acceleration = np.array([0.3, -0.2, 0.5]), np.array([-0.04, 0.1, 0.02])
    law = random_spline(degree, count, goal, start_rate=rate, start_acceleration=acceleration)
    peer = BSpline(law.knots, np.asarray(law.control_points), degree)
    for order, asked in enumerate((START, rate, acceleration)):
        np.testing.assert_allclose(peer(0.0, nu=order) / DURATION**order, asked, rtol=0, atol=1e-13)
    at_start, at_end = law.boundary()
    assert at_start.rate is rate
    assert at_start.acceleration is acceleration
    rest = random_spline(degree, count, goal)
    assert (at_end.position is None) == (rest.goal is None)
    # Nothing but the beginning has changed.
    np.testing.assert_array_equal(law.control_points[3:], rest.control_points[3:])


def test_a_missing_rate_is_zero_and_a_wrong_one_is_refused():
    law = random_spline(start_acceleration=np.array([0.1, 0.2, 0.3]))
    np.testing.assert_array_equal(law.start_rate, np.zeros(3))
    with pytest.raises(InputError, match=r"start_rate has the shape \(2,\); \(3,\) is expected"):
        random_spline(start_rate=np.zeros(2))


def test_the_box_is_about_the_straight_way_and_inside_the_limits_which_then_hold():
    lower, upper = np.array([-2.0, -0.6, 0.0]), np.array([3.0, 1.3, 4.0])
    law = ClampedBSpline.between(START, GOAL, DURATION, 4, 9, lower, upper, box=1.0)
    assert isinstance(law, PlannedTrajectory)
    np.testing.assert_allclose(law.inner, START + np.array([[0.25], [0.5], [0.75]]) * (GOAL - START))
    low, high = law.free_bounds()
    np.testing.assert_allclose(low, np.maximum(law.inner - 1, lower).ravel(), rtol=0, atol=1e-15)
    np.testing.assert_allclose(high, np.minimum(law.inner + 1, upper).ravel(), rtol=0, atol=1e-15)
    free = np.random.default_rng(3).uniform(low, high, (100, 9))
    q = jax.jit(jax.vmap(lambda f: law.with_free(f).on_grid(jnp.linspace(0, DURATION, 101))[0]))(free)
    assert np.all(q >= lower[:, None] - 1e-14)
    assert np.all(q <= upper[:, None] + 1e-14)
    assert np.ptp(q[:, :, 50], axis=0).min() > 0.3


def test_the_least_duration_just_keeps_the_limits():
    law = random_spline(4, 9)
    velocity, acceleration = np.array([1.0, 2.0, 3.0]), np.array([0.5, 0.7, 0.9])
    for limits, binding in (((velocity, 1e3 * acceleration), 1), ((1e3 * velocity, acceleration), 2)):
        least = float(law.least_duration(*limits))
        timed = ClampedBSpline.between(START, GOAL, least, 4, 9, inner=law.inner)
        found = sample(timed, np.linspace(0, least, 5001))
        ratios = [np.max(np.abs(x) / limit[:, None]) for x, limit in zip(found[1:], limits, strict=True)]
        assert abs(ratios[binding - 1] - 1) < 2e-3
        assert ratios[2 - binding] < 1


def test_the_duration_may_be_free():
    law = random_spline(4, 8, duration_bounds=(5.0, 9.0))
    low, high = law.free_bounds()
    chex.assert_shape([low, high], (7,))
    assert (low[-1], high[-1]) == (5, 9)
    moved = law.with_free(np.append(np.zeros(6), 8.0))
    assert moved.duration == 8
    np.testing.assert_allclose(moved(8.0)[0], GOAL, rtol=0, atol=1e-14)


def test_gradients_are_finite_at_every_knot_and_right():
    law = random_spline(4, 8, duration_bounds=(5.0, 9.0))

    def loss(law):
        times = jnp.asarray(np.unique(law.knots)) * law.duration
        return sum(jnp.sum(jnp.sin(x)) for x in law.on_grid(times))

    gradient, value = jax.jit(jax.grad(loss))(law), jax.jit(loss)
    chex.assert_tree_all_finite(gradient)
    step = 1e-6
    for index in ((0, 0), (1, 2)):
        moved = [law.inner.copy() + sign * step * _unit(law.inner.shape, index) for sign in (1, -1)]
        ahead, behind = (float(value(law.with_free(np.append(x.ravel(), DURATION)))) for x in moved)
        np.testing.assert_allclose(gradient.inner[index], (ahead - behind) / (2 * step), rtol=0, atol=1e-7)


def _unit(shape, index):
    unit = np.zeros(shape)
    unit[index] = 1
    return unit


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"degree": 2}, "degree is 2; a whole number of at least 3"),
        ({"control_points": 5}, "control_points is 5; a whole number of at least 6"),
        ({"goal": None, "control_points": 4}, "control_points is 4; a whole number of at least 5"),
        ({"upper": [3, 1, 4]}, r"joint 1: start 1.2 lies outside the position limits \[-inf, 1\]"),
        ({"lower": 0.0, "joint_names": ["a", "b", "c"]}, "a: start -1.5 lies outside"),
        ({"inner": np.zeros((3, 3))}, "inner control points have the shape"),
        ({"goal": [1]}, "goal has 1 numbers; start has 3"),
        ({"duration": np.inf}, "duration is inf s"),
        ({"box": 0}, "box is 0"),
    ],
)
def test_refusals(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        ClampedBSpline.between(**{"start": START, "goal": GOAL, "duration": DURATION, **changes})
