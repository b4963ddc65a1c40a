"""Timings from tables and the fastest ones: closed forms, a linear programme, limits on a finer grid, refusals."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import linprog
from tool_differences import sample

from jffsr.errors import InputError
from jffsr.trajectories.cartesian.arc import Arc
from jffsr.trajectories.cartesian.fastest import fastest_timing, rate_bound
from jffsr.trajectories.cartesian.fastest_tool import fastest_tool_timing
from jffsr.trajectories.cartesian.line import Line
from jffsr.trajectories.cartesian.tabulated import Tabulated
from jffsr.trajectories.cartesian.timing import Trapezoid
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory

UNIT = [1.0, 0.0, 0.0, 0.0]
GRID = np.linspace(0, 1, 101)


@jax.jit
def at_times(timing, times):
    return jnp.stack(jax.vmap(timing)(times))


@jax.jit
def fastest(bound, slopes, bends, limits, start=0.0, end=0.0):
    """One compilation for two joints over the grid."""
    return fastest_timing(GRID, bound, slopes, bends, limits, start, end)


def joints(s):
    """Two joints along a path, with two derivatives by s, (k, 2) each; the first turns back at s = 0.35."""
    q = np.stack([np.cos(4 * (s - 0.35)), 2 * s + 0.3 * np.sin(5 * s)], axis=1)
    slope = np.stack([-4 * np.sin(4 * (s - 0.35)), 2 + 1.5 * np.cos(5 * s)], axis=1)
    bend = np.stack([-16 * np.cos(4 * (s - 0.35)), -7.5 * np.sin(5 * s)], axis=1)
    return q, slope, bend


def straight(size):
    """Slopes and bends of one joint that goes `size` evenly, and of one that does not move."""
    return np.tile([size, 0.0], (GRID.size, 1)), np.zeros((GRID.size, 2))


def test_table_is_the_exact_law():
    """A trapezoid's own rates give the trapezoid back, at any time and beyond the ends."""
    law = Trapezoid.over(10.0, 0.25)
    peak, ramp = 1 / 7.5, 1 / 6
    places = np.array([0, ramp / 4, ramp, 0.4, 1 - ramp, 1])
    table = Tabulated.over(places, peak * np.array([0, 0.5, 1, 1, 1, 0]))
    np.testing.assert_allclose(table.duration, 10, rtol=0, atol=1e-14)
    times = np.concatenate([[-1.0, 11.0], np.linspace(0.01, 9.99, 60)])
    np.testing.assert_allclose(at_times(table, times), at_times(law, times), rtol=0, atol=1e-14)
    same = Tabulated.at_times([0, 2.5, 4, 7.5, 10], [0, 3, 3, 3, 0])
    np.testing.assert_allclose(at_times(same, times), at_times(law, times), rtol=0, atol=1e-14)
    slower = Tabulated.over(places, [0, 0.5, 1, 1, 1, 0], 10.0)
    np.testing.assert_allclose(slower.rates, table.rates, rtol=0, atol=1e-15)


def test_rates_of_a_table_are_those_of_its_places():
    table = Tabulated.over([0, 0.1, 0.35, 0.7, 1], [0.0, 0.3, 0.1, 0.6, 0.2])
    times, step = np.linspace(0.05, float(table.duration) - 0.05, 41), 1e-5
    s, rate, acceleration = at_times(table, times)
    ahead, behind = at_times(table, times + step), at_times(table, times - step)
    away = np.min(np.abs(times[:, None] - np.asarray(table.times)), axis=1) > step
    assert np.sum(away) > 35
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * step), rate, rtol=0, atol=1e-4)
    np.testing.assert_allclose(((ahead[0] - behind[0]) / (2 * step))[away], rate[away], rtol=0, atol=1e-10)
    np.testing.assert_allclose(((ahead[1] - behind[1]) / (2 * step))[away], acceleration[away], atol=1e-9)
    assert np.all(np.diff(s) > 0)
    # It passes its rows.
    np.testing.assert_allclose(
        at_times(table, table.times[1:-1])[:2], [table.places[1:-1], table.rates[1:-1]], rtol=0, atol=1e-14
    )


def test_constant_limits_give_the_trapezoid_and_the_triangle():
    """D/V + V/A, with ramps V^2/(2 A D) of the way, and 2 sqrt(D/A)."""
    slopes, bends = straight(1.6)
    speed, acceleration = 0.4, 0.25
    timing = fastest(rate_bound(slopes, np.array([speed, 1.0])), slopes, bends, np.array([acceleration, 1.0]))
    whole = 1.6 / speed + speed / acceleration
    assert speed**2 / (2 * acceleration * 1.6) == pytest.approx(0.2)
    np.testing.assert_allclose(timing.duration, whole, rtol=1e-13)
    law = Trapezoid.over(whole, speed / acceleration / whole)
    times = np.linspace(0.01, whole - 0.01, 50)
    np.testing.assert_allclose(at_times(timing, times), at_times(law, times), rtol=0, atol=1e-13)
    triangle = fastest(np.full(101, np.inf), slopes, bends, np.array([acceleration, 1.0]))
    np.testing.assert_allclose(triangle.duration, 2 * np.sqrt(1.6 / acceleration), rtol=1e-13)


def test_a_dip_of_the_bound_is_braked_for_and_left_again():
    """High, low from 0.4 to 0.6, high: every ramp is (V^2 - v^2)/(2 A) long."""
    acceleration, high, low = 1.0, np.sqrt(0.2), np.sqrt(0.08)
    bound = np.where((GRID > 0.4 - 1e-9) & (GRID < 0.6 + 1e-9), low, high)
    slopes, bends = straight(1.0)
    timing = fastest(bound, slopes, bends, np.array([acceleration, 1.0]))
    # Ramps of 0.1, 0.06, 0.06 and 0.1 of the way, their ends on the grid.
    expected = 2 * (high + (high - low)) / acceleration + 0.2 / low + 2 * (0.4 - 0.16) / high
    np.testing.assert_allclose(timing.duration, expected, rtol=1e-13)
    np.testing.assert_allclose(
        timing.rates[np.array([10, 34, 40, 60, 66])], [high, high, low, low, high], rtol=1e-13
    )
    assert np.all(np.asarray(timing.rates) <= bound + 1e-15)


def feasible(slopes, bends, limits):
    """Matrix and right side of |q' u + q'' x| <= limits at both ends of all steps, for unknowns x (k,)."""
    count, step = GRID.size, GRID[1]
    rows, right = [], []
    for k in range(count - 1):
        for at in (k, k + 1):
            for j in range(slopes.shape[1]):
                row = np.zeros(count)
                row[[k, k + 1]] = slopes[at, j] / (2 * step) * np.array([-1, 1])
                row[at] += bends[at, j]
                rows += [row, -row]
                right += [limits[j], limits[j]]
    return np.array(rows), np.array(right)


def test_no_feasible_profile_is_faster():
    """The linear programme's largest sum of (ds/dt)^2, under several weights, is at the same profile.

    Only in the steps where a joint turns back can one place be faster at another's cost, by a thousandth here.
    """
    _, slopes, bends = joints(GRID)
    limits, rates = np.array([3.0, 1.5]), np.array([2.5, 1.2])
    bound = np.asarray(rate_bound(slopes, rates))
    timing = fastest(bound, slopes, bends, limits)
    squares = np.asarray(timing.rates) ** 2
    matrix, right = feasible(slopes, bends, limits)
    assert np.max(matrix @ squares - right) < 1e-10
    top = np.minimum(bound**2, 1e6)
    top[[0, -1]] = 0
    rng = np.random.default_rng(4)
    for _ in range(3):
        weights = rng.uniform(0.2, 1, GRID.size)
        best = linprog(-weights, A_ub=matrix, b_ub=right, bounds=np.stack([np.zeros(101), top], axis=1)).x
        turning = np.abs(GRID - 0.35) < 0.045
        np.testing.assert_allclose(squares[~turning], best[~turning], rtol=0, atol=1e-7)
        np.testing.assert_allclose(squares[turning], best[turning], rtol=1e-3)
        assert timing.duration < Tabulated.over(GRID, np.sqrt(best)).duration + 1e-5


def test_random_paths_of_six_joints_are_gone_as_fast_as_the_linear_programme_says():
    """Every limit held at both ends of each step to rounding; the duration within 1e-4 of the programme's."""
    timed = jax.jit(lambda *x: fastest_timing(GRID, *x))
    rng = np.random.default_rng(0)
    for _ in range(4):
        turns, phase, size, way = (rng.uniform(a, b, 6) for a, b in ((0, 8), (0, 6), (-2, 2), (-1, 1)))
        slopes = size * turns * np.cos(turns * GRID[:, None] + phase) + way
        bends = -size * turns**2 * np.sin(turns * GRID[:, None] + phase)
        limits, rates = rng.uniform(0.2, 2, (2, 6))
        bound = np.asarray(rate_bound(slopes, rates))
        timing = timed(bound, slopes, bends, limits)
        squares = np.asarray(timing.rates) ** 2
        matrix, right = feasible(slopes, bends, limits)
        assert np.max(matrix @ squares / right) < 1 + 1e-12
        assert np.all(timing.rates <= bound * (1 + 1e-14))
        best = linprog(
            -np.ones(101), matrix, right, bounds=[(0, 0), *((0, x * x) for x in bound[1:-1]), (0, 0)]
        ).x
        ideal = Tabulated.over(GRID, np.sqrt(np.maximum(best, 0))).duration
        np.testing.assert_allclose(timing.duration, ideal, rtol=1e-4)


def test_limits_hold_between_the_places_of_the_grid():
    """At ten times as many times as steps, of the joints' closed form; to the second order of the step."""
    _, slopes, bends = joints(GRID)
    limits, rates = np.array([3.0, 1.5]), np.array([2.5, 1.2])
    timing = fastest(rate_bound(slopes, rates), slopes, bends, limits)
    times = np.linspace(0, float(timing.duration), 1001)[1:-1]
    s, rate, acceleration = (np.asarray(x)[:, None] for x in at_times(timing, times))
    assert np.all(np.diff(s[:, 0]) > 0)
    _, slope, bend = joints(s[:, 0])
    rate_share = np.abs(slope * rate) / rates
    share = np.abs(slope * acceleration + bend * rate**2) / limits
    assert np.max(rate_share) < 1 + 5e-4
    assert np.max(share) < 1 + 1e-3
    # Nearly everywhere some limit is met, at one end of the step at least: that is what is fastest.
    largest = np.max(np.hstack([rate_share, share]), axis=1)
    assert np.min(largest) > 0.85
    assert np.mean(largest) > 0.98


def test_start_and_end_rates_are_kept_where_possible():
    slopes, bends = straight(1.0)
    timing = fastest(np.full(101, 0.5), slopes, bends, np.array([1.0, 1.0]), 0.3, 0.2)
    np.testing.assert_allclose(timing.rates[np.array([0, -1])], [0.3, 0.2], rtol=1e-14)
    # A start too fast for a stop at once.
    low = np.where(GRID > 0.035, 0.1, 9.0)
    timing = fastest(low, slopes, bends, np.array([1.0, 1.0]), 5.0, 0.0)
    np.testing.assert_allclose(timing.rates[0], np.sqrt(0.1**2 + 2 * 0.04), rtol=1e-12)


def test_fastest_timings_have_right_gradients_and_vmap():
    _, slopes, bends = joints(GRID)
    bound = rate_bound(slopes, np.array([2.5, 1.2]))

    @jax.jit
    def durations(limits):
        return jax.vmap(lambda x: fastest_timing(GRID, bound, slopes, bends, x).duration)(limits)

    limits = np.array([[3.0, 1.5], [4.0, 1.0]])
    gradient = jax.jit(jax.grad(lambda x: jnp.sum(durations(x))))(limits)
    chex.assert_tree_all_finite(gradient)
    for index in ((0, 1), (1, 0)):
        step = np.zeros((2, 2))
        step[index] = 1e-6
        ahead, behind = durations(limits + step), durations(limits - step)
        np.testing.assert_allclose(gradient[index], np.sum(ahead - behind) / 2e-6, rtol=1e-5)


def test_without_acceleration_limits_the_bound_is_taken_at_once():
    timing = fastest_timing(GRID, np.full(101, 0.5))
    np.testing.assert_allclose(timing.duration, 0.98 / 0.5 + 2 * 2 * 0.01 / 0.5, rtol=1e-13)


def test_a_line_of_the_tool_takes_the_closed_form():
    """The slower of the move and the turn bounds each phase: here rate by the turn, acceleration by the move."""
    line = Line.between(([0, 0, 0], UNIT), ([0.9, 1.2, 0], [np.cos(0.5), 0, np.sin(0.5), 0]))
    timing = fastest_tool_timing(line, 1.0, 0.25, 0.15, 0.5)
    # ds/dt <= 0.25/1, d2s/dt2 <= 0.15/1.5: ramps of 0.3125 of the way, between two places of the grid.
    np.testing.assert_allclose(timing.duration, 1 / 0.25 + 0.25 / 0.1, rtol=2e-5)
    assert timing.duration >= 1 / 0.25 + 0.25 / 0.1 - 1e-12


def test_a_half_circle_of_the_tool_is_within_the_polygon_of_the_closed_form():
    """x = A/(R f^2) sin(2 f s) up to the largest, at which all the acceleration is centripetal."""
    radius, angle, most = 0.7, np.pi, 0.3
    arc = Arc.about([0, 0, 0], [0, 0, 1], ([radius, 0, 0], UNIT), angle)
    timing = fastest_tool_timing(arc, 50.0, 50.0, most, 50.0, 400)

    def rate(s):
        return np.sqrt(most / (radius * angle**2) * np.sin(2 * angle * min(s, 1 - s, 0.25)))

    closed = 2 * (quad(lambda s: 1 / rate(s), 0, 0.25)[0] + 0.25 / rate(0.5))
    assert closed < timing.duration < 1.006 * closed
    found = sample(ToolTrajectory(arc, timing), np.linspace(0, float(timing.duration), 2000))
    size = np.linalg.norm(found.acceleration[:, :3], axis=1)
    assert 0.99 * most < np.max(size) < 1.001 * most


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Tabulated.over([0, 0.5, 0.4, 1], [1, 1, 1, 1]), "places of a timing must rise from 0 to 1"),
        (lambda: Tabulated.over([0, 1], [0, 1, 2]), r"have the shapes \(2,\) and \(3,\)"),
        (lambda: Tabulated.over([0, 0.5, 0.7, 1], [1, 0, 0, 1]), "rates 1 and 2 of a timing are both zero"),
        (lambda: Tabulated.over([0, 1], [1, -1]), "finite and not negative"),
        (lambda: Tabulated.over([0, 1], [1, 1], -2.0), "duration is -2 s"),
        (lambda: Tabulated.at_times([0, 2, 1], [0, 1, 0]), "times of a timing must rise from 0"),
        (lambda: fastest_timing(GRID, np.ones(7)), r"have the shapes \(101,\) and \(7,\)"),
        (lambda: fastest_timing([0, 0.5, 1], [1, 0, 1]), "largest_rate on the way is 0; it must be positive"),
        (lambda: fastest_timing([0, 0.5, 1], [1, np.inf, 1]), "on the way is inf; .* positive and finite"),
        (lambda: fastest_timing([0, 1], [1, -1]), "largest_rate at an end is -1"),
        (lambda: fastest_timing([0, 1], [1, 1], np.ones((2, 1))), "are given together or not at all"),
        (
            lambda: fastest_timing([0, 1], [1, 1], np.ones((2, 1)), np.ones((2, 1)), np.ones(2)),
            r"\(2, n\) twice and \(n,\) are expected",
        ),
        (
            lambda: fastest_timing([0, 1], [1, 1], np.ones((2, 1)), np.ones((2, 1)), np.zeros(1)),
            "acceleration_limits is 0; it must be positive and finite",
        ),
        (lambda: fastest_tool_timing(None, 1.0, 1.0, 0.0, 1.0), "acceleration is 0.0 m/s"),
        (
            lambda: fastest_tool_timing(None, 1.0, 1.0, 1.0, 1.0, 1),
            "steps is 1; a whole number of at least 2",
        ),
    ],
)
def test_refusals(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
