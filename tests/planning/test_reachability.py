"""Least times from rest to rest, against closed forms and a brute-force simulation."""

from __future__ import annotations

import numpy as np
import pytest
from wu6_problems import GOAL, START, limited

from jffsr.errors import InputError
from jffsr.planning.reachability import check_duration_possible, least_durations


@pytest.fixture(scope="module")
def arm(robots):
    return robots["wu_2018_6dof"]


def slowest(distance: float, rate: float, acceleration: float, steps: int = 200_000) -> float:
    """Time to cross the distance by always going as fast as stopping in time allows, in small steps of way."""
    x = (np.arange(steps) + 0.5) / steps * distance
    fastest = np.minimum(rate, np.sqrt(2 * acceleration * np.minimum(x, distance - x)))
    return float(np.sum(distance / steps / fastest))


def test_against_brute_force(arm):
    for rate, acceleration in ((0.25, 0.2), (10.0, 0.2), (0.05, 3.0)):
        robot = limited(arm, rate, acceleration)
        least = least_durations(robot, START, GOAL)
        for d, time in zip(np.abs(GOAL - START), least, strict=True):
            # The two ends, where the speed goes to zero, cost the midpoint rule the root of a step.
            assert time == pytest.approx(slowest(d, rate, acceleration), rel=2e-3)


def test_closed_forms(arm):
    goal = START + np.array([0.5, -0.5, 0.0, 2.0, 0.3125, 0.1])
    least = least_durations(limited(arm, 0.25, 0.2), START, goal)
    trapezoid = lambda d: d / 0.25 + 0.25 / 0.2  # noqa: E731
    triangle = lambda d: 2 * np.sqrt(d / 0.2)  # noqa: E731
    expected = [trapezoid(0.5), trapezoid(0.5), 0.0, trapezoid(2.0), triangle(0.3125), triangle(0.1)]
    np.testing.assert_allclose(least, expected, rtol=1e-12)
    assert triangle(0.3125) == pytest.approx(trapezoid(0.3125))


def test_without_limits(arm):
    inf = np.inf
    np.testing.assert_array_equal(least_durations(limited(arm, inf, inf), START, GOAL), np.zeros(6))
    distance = np.abs(GOAL - START)
    np.testing.assert_allclose(least_durations(limited(arm, 0.25, inf), START, GOAL), distance / 0.25)
    np.testing.assert_allclose(
        least_durations(limited(arm, inf, 0.2), START, GOAL), 2 * np.sqrt(distance / 0.2)
    )
    assert np.all(least_durations(limited(arm, inf, inf), START, START) == 0)


def refusal(robot, duration, goal=GOAL) -> str:
    with pytest.raises(InputError) as caught:
        check_duration_possible(robot, START, goal, duration, where="task.duration")
    return str(caught.value)


def test_four_seconds_are_too_short_under_the_acceleration_limit(arm):
    """Joints 1 and 6 turn by 55 degrees: 2 sqrt(0.9599/0.2) = 4.38 s."""
    text = refusal(limited(arm, np.inf, 0.2), 4.0)
    assert text.startswith("task.duration: found 4 s, at least 4.38 s is needed: joint1 moves 55 deg")
    assert "joint6 moves 55 deg from rest to rest, which needs 4.38 s under its acceleration limit" in text
    assert "0.2 rad/s^2" in text
    assert not any(f"joint{i}" in text for i in (2, 3, 4, 5))
    assert "inf" not in text


def test_a_rate_limit_needs_more(arm):
    text = refusal(limited(arm, 0.25, 0.2), 4.0)
    assert "at least 5.09 s is needed" in text
    assert "4.38 s under its acceleration limit of 0.2 rad/s^2 alone and 5.09 s with its rate limit" in text
    assert "0.25 rad/s as well" in text
    # Joints 4 and 5 need 4.04 s; the sentence names those that need most.
    assert "joint4" not in text
    only_rate = refusal(limited(arm, 0.2, np.inf), 4.0)
    assert "4.80 s under its rate limit of 0.2 rad/s" in only_rate
    assert "acceleration" not in only_rate


def test_enough_time_is_accepted(arm):
    check_duration_possible(limited(arm, 0.25, 0.2), START, GOAL, 5.1)
    check_duration_possible(limited(arm, np.inf, 0.2), START, GOAL, 4.39)


def test_sliding_joints_are_told_in_metres(robots):
    robot = robots["two_arms"]
    slides = [i for i, kind in enumerate(robot.topology.joint_types) if kind == "prismatic"]
    assert slides
    start, goal = np.zeros(robot.num_joints), np.zeros(robot.num_joints)
    goal[slides[0]] = -0.5
    with pytest.raises(InputError) as caught:
        check_duration_possible(limited(robot, 0.1, 0.2), start, goal, 1.0)
    name = robot.joint_names[slides[0]]
    assert f"{name} moves 0.5 m from rest to rest" in str(caught.value)
    assert "0.2 m/s^2" in str(caught.value)
