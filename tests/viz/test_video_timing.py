"""When a film's pictures are taken, and what is between the frames of a replay."""

from __future__ import annotations

import numpy as np
import pytest
from replay_of_boxes import two_boxes
from scipy.spatial.transform import Rotation, Slerp

from jffsr.errors import InputError
from jffsr.viz.replay.film.between import Place, mixed, near, place_at, turned
from jffsr.viz.replay.film.timing import film_timing, speed_text
from jffsr.viz.replay.shading import AT, warned


@pytest.mark.parametrize(
    ("span", "speed"),
    [(10.0, 1.0), (6.0, 1.0), (20.0, 1.0), (30.0, 1.5), (41.0, 2.5), (600.0, 30.0), (3.0, 0.5), (0.1, 0.015)],
)
def test_a_film_runs_in_real_time_or_at_the_next_round_speed(span, speed):
    timing = film_timing([two_boxes(span=span)], 30)
    assert timing.speed == pytest.approx(speed, rel=1e-12)
    assert 6.0 - 1e-9 <= span / timing.speed <= 20.0 + 1e-9


def test_pictures_are_evenly_spaced_and_the_last_one_stands():
    times = film_timing([two_boxes(span=8.0)], 25, speed=2.0).times
    moving = times[: 4 * 25 + 1]
    np.testing.assert_allclose(np.diff(moving), 2.0 / 25, rtol=1e-9)
    np.testing.assert_array_equal(times[len(moving) :], 8.0)
    assert len(times) - len(moving) == 12


def test_several_motions_share_one_clock():
    late = two_boxes(span=3.0)
    late = type(late)(late.title, late.time + 5.0, late.solids)
    timing = film_timing([two_boxes(span=2.0), late], 30)
    assert (timing.start, timing.end) == (0.0, 8.0)


def test_a_replay_that_stands_still_lasts_as_long_as_a_short_film():
    still = two_boxes(span=0.0, frames=1)
    timing = film_timing([still], 10)
    assert len(timing.times) == 61 + 5
    assert np.ptp(timing.times) == 0.0


def test_far_too_many_pictures_are_refused():
    with pytest.raises(InputError, match="60000 pictures, at most 36000"):
        film_timing([two_boxes(span=2.0)], 30, speed=0.001)


def test_the_speed_is_written_unless_it_is_real_time():
    assert [speed_text(speed) for speed in (1.0, 2.0, 1.5, 0.015)] == ["", "x2", "x1.5", "x0.015"]


def test_places_are_within_the_frames():
    time = np.array([1.0, 2.0, 4.0])
    assert place_at(time, 0.0) == Place(0, 0.0)
    assert place_at(time, 1.25) == Place(0, 0.25)
    assert place_at(time, 3.0) == Place(1, 0.5)
    assert place_at(time, 9.0) == Place(1, 1.0)
    assert place_at(np.array([2.0]), 5.0) == Place(0, 0.0)


def test_positions_go_straight_and_frames_are_met():
    points = np.array([[0.0, 0.0, 0.0], [2.0, 4.0, 0.0], [2.0, 4.0, 6.0]])
    np.testing.assert_allclose(mixed(points, Place(0, 0.25)), [0.5, 1.0, 0.0], rtol=1e-15)
    np.testing.assert_array_equal(mixed(points, Place(1, 1.0)), points[2])


@pytest.mark.parametrize("flipped", [1.0, -1.0])
def test_attitudes_turn_as_those_of_scipy(flipped):
    ends = Rotation.random(2, random_state=3)
    quaternions = ends.as_quat(scalar_first=True) * [[1.0], [flipped]]
    for share in (0.0, 0.3, 0.8, 1.0):
        found = Rotation.from_quat(turned(quaternions, Place(0, share)), scalar_first=True)
        expected = Slerp([0.0, 1.0], ends)(share)
        assert (found.inv() * expected).magnitude() < 1e-9


def test_beside_a_nearness_that_is_not_finite_everything_between_is_red():
    values = np.array([0.2, np.inf, 0.4])
    assert near(None, Place(0, 0.5)) == 0.0
    assert near(values, Place(0, 0.0)) == 0.2
    assert near(values, Place(1, 1.0)) == 0.4
    for share in (0.1, 0.9):
        assert warned((0.0, 0.0, 1.0), near(values, Place(0, share))) == AT
        assert warned((0.0, 0.0, 1.0), near(values, Place(1, share))) == AT
