"""Singularities of planar arms, whose determinants and singular postures are known in closed form."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from jffsr.rollouts.motion import Motion
from jffsr.tracking.singularity.along import singularities
from jffsr.tracking.singularity.between import Postures
from jffsr.tracking.singularity.nearest import Bounds
from jffsr.tracking.singularity.scan import grid_postures, singularity_scan

PLANE = ("x", "y")
# Base and two links of Hu, Wang and Shi 2011: mass, moment; base centre to joint 1, then links of 1 m.
MASS, MOMENT, BASE_ARM = np.array([400.0, 40.0, 30.0]), np.array([66.67, 3.33, 2.50]), 0.5


def closed_determinant(q1, q2):
    """Determinant of the generalized Jacobian of the tip's x and y, from the arm's geometry alone.

    Seen from the system's centre of mass, the centres of mass c_k and the tip are sums of the absolute directions
    e_i of base and links, b_ki e_i and a_i e_i. Angular momentum sum_ij M_ij cos(t_i - t_j) w_j = sum_j h_j w_j is
    zero, and the determinant of the tip's velocity under that condition is the bordered one over sum h.
    """
    total = MASS.sum()
    from_base = np.array([[0, 0, 0], [BASE_ARM, 0.5, 0], [BASE_ARM, 1.0, 0.5]])
    centre = MASS @ from_base / total
    b = from_base - centre
    a = np.array([BASE_ARM, 1.0, 1.0]) - centre
    inertia = np.einsum("k,ki,kj->ij", MASS, b, b) + np.diag(MOMENT)
    angle = np.array([0.0, q1, q1 + q2])
    h = np.sum(inertia * np.cos(angle[:, None] - angle[None]), axis=0)
    bordered = (
        h[0] * a[1] * a[2] * np.sin(q2)
        - h[1] * a[0] * a[2] * np.sin(q1 + q2)
        + h[2] * a[0] * a[1] * np.sin(q1)
    )
    return bordered / h.sum()


def closed_smallest(q2):
    """Smallest singular value of the tip's Jacobian with the base held, which depends on q2 only."""
    # J = [[-s1 - s12, -s12], [c1 + c12, c12]] has squares' sum 3 + 2 cos q2 and determinant sin q2.
    squares, det = 3 + 2 * np.cos(q2), np.sin(q2)
    return np.sqrt(0.5 * (squares - np.sqrt(squares**2 - 4 * det**2)))


@pytest.fixture(scope="module")
def planar(robots):
    return robots["hu_2011_planar2"]


def swing(samples=201, q1=(1.5, 1.0), q2=(1.5, -1.5), duration=10.0):
    """Both joints by a sine over half a period, with their rates; and the motion as a function of time."""

    def at(time):
        share = 0.5 - 0.5 * np.cos(np.pi * np.asarray(time) / duration)
        return np.stack([q1[0] + (q1[1] - q1[0]) * share, q2[0] + (q2[1] - q2[0]) * share], axis=-1)

    time = np.linspace(0, duration, samples)
    rate = 0.5 * np.pi / duration * np.sin(np.pi * time / duration)[:, None]
    return at, Postures(time, at(time), rate * np.array([q1[1] - q1[0], q2[1] - q2[0]]))


@pytest.fixture(scope="module")
def floating_report(planar):
    at, motion = swing()
    return at, singularities(planar, motion, directions=PLANE)


def test_determinant_and_its_zero_are_those_of_the_closed_form(floating_report):
    at, report = floating_report
    expected = [closed_determinant(*q) for q in at(report.time)]
    np.testing.assert_allclose(report.determinant, expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(report.manipulability, np.abs(expected), rtol=0, atol=1e-12)
    root = brentq(lambda t: closed_determinant(*at(t)), 4.0, 6.0, xtol=1e-12)
    (interval,) = report.intervals
    (point,) = interval.points
    assert point.crossing
    assert abs(point.time - root) < 1e-6
    np.testing.assert_allclose(point.joint_position, at(root), atol=1e-6)
    assert interval.start < root < interval.end
    assert point.smallest < 1e-6
    assert report.closest.time == point.time


def test_a_zero_away_from_the_stretched_arm_is_dynamic(floating_report):
    """J_m loses rank where q2 = 0 and nowhere near else, so that the distance to it is |q2|."""
    _, report = floating_report
    point = report.intervals[0].points[0]
    assert abs(point.joint_position[1]) > np.deg2rad(10)
    assert point.kind == "dynamic"
    np.testing.assert_allclose(point.fixed_base_distance, abs(point.joint_position[1]), rtol=1e-6)
    np.testing.assert_allclose(
        point.fixed_base_singular_value, closed_smallest(point.joint_position[1]), rtol=1e-6
    )
    assert point.posture_distance < 1e-6


def test_the_kind_follows_the_bounds(planar):
    _, motion = swing()
    for bounds, kind in ((Bounds(0.3, 0.5), "kinematic"), (Bounds(0.05, 0.5), "mixed")):
        report = singularities(planar, motion, directions=PLANE, bounds=bounds)
        assert report.intervals[0].points[0].kind == kind


def test_stretched_along_the_base_the_zero_is_kinematic(planar):
    """With base and links in one line neither arm can reach further, whatever the base does."""
    _, motion = swing(q1=(0.0, 0.0), q2=(0.4, -0.4))
    report = singularities(planar, motion, directions=PLANE)
    (point,) = report.intervals[0].points
    assert abs(point.time - 5.0) < 1e-6
    assert point.kind == "kinematic"
    assert point.fixed_base_distance < 1e-6
    np.testing.assert_allclose(np.abs(point.lost_I[0]), [1, 0, 0, 0, 0, 0], atol=1e-6)
    assert "moving along the tool's x, 1.00" in report.to_text()


def test_with_the_base_held_the_stretched_arm_loses_its_own_direction(planar):
    at, motion = swing()
    report = singularities(planar, motion, directions=PLANE, base_mode="fixed")
    (point,) = report.intervals[0].points
    root = brentq(lambda t: at(t)[1], 4.0, 6.0, xtol=1e-12)
    assert abs(point.time - root) < 1e-6
    assert point.kind == "kinematic"
    q1 = at(root)[0]
    np.testing.assert_allclose(
        np.abs(point.lost_I[0]), np.abs([np.cos(q1), np.sin(q1), 0, 0, 0, 0]), atol=1e-6
    )
    np.testing.assert_allclose(np.abs(point.lost_E[0]), [1, 0, 0, 0, 0, 0], atol=1e-6)
    # The tip stands still where joint 2 turns back twice as fast as joint 1 turns: J columns are (2, 1) across.
    motion = point.idle_joints[0] / point.idle_joints[0][0]
    np.testing.assert_allclose(motion, [1, -2], atol=1e-6)
    np.testing.assert_allclose(
        report.singular_values[:, -1], closed_smallest(at(report.time)[:, 1]), rtol=0, atol=1e-12
    )


def test_a_minimum_between_samples_and_the_ends_of_the_stretch(planar):
    """q2 comes down to 0.02 rad and goes up again: the determinant keeps its sign."""
    time = np.linspace(0, 10, 24)
    lowest, least = 4.321, 0.02
    q2 = least + 0.05 * (time - lowest) ** 2
    joints = np.stack([np.ones_like(time), q2], axis=1)
    rates = np.stack([np.zeros_like(time), 0.1 * (time - lowest)], axis=1)
    report = singularities(
        planar, Postures(time, joints, rates), directions=PLANE, base_mode="fixed", threshold=0.05
    )
    (interval,) = report.intervals
    (point,) = interval.points
    assert not point.crossing
    assert abs(point.time - lowest) < 1e-6
    np.testing.assert_allclose(point.smallest, closed_smallest(least), rtol=1e-9)
    np.testing.assert_allclose(point.posture_distance, least, rtol=1e-6)
    reach = brentq(lambda q: closed_smallest(q) - 0.05, 0.01, 0.5, xtol=1e-14)
    half = np.sqrt((reach - least) / 0.05)
    np.testing.assert_allclose([interval.start, interval.end], [lowest - half, lowest + half], atol=1e-6)
    np.testing.assert_array_equal(report.near, (time > interval.start) & (time < interval.end))


def test_rates_held_over_each_sample_are_followed_straight(planar):
    time = np.array([0.0, 1.0, 2.0, 4.0])
    q2 = np.array([0.9, 0.5, 0.3, -0.1])
    joints = np.stack([np.ones(4), q2], axis=1)
    rates = np.zeros((4, 2))
    rates[:-1, 1] = np.diff(q2) / np.diff(time)
    for motion in (Postures(time, joints, rates), Postures(time, joints)):
        report = singularities(planar, motion, directions=PLANE, base_mode="fixed")
        assert abs(report.closest.time - 3.5) < 1e-6
        assert report.closest.crossing


def test_a_motion_says_how_its_base_was_held_and_a_result_has_a_motion(planar):
    at, plain = swing(41)
    rows = len(plain.time)
    motion = Motion(
        time=plain.time,
        base_position=np.zeros((rows, 3)),
        base_quaternion=np.tile([1.0, 0, 0, 0], (rows, 1)),
        base_twist=np.zeros((rows, 6)),
        joint_position=plain.joint_position,
        joint_velocity=plain.joint_velocity,
        joint_acceleration=np.zeros((rows, 2)),
        momentum=np.zeros(6),
        joint_grid=None,
        base_mode="fixed",
    )
    for given in (motion, SimpleNamespace(motion=motion)):
        report = singularities(planar, given, directions=PLANE)
        assert report.base_mode == "fixed"
        assert abs(report.closest.time - brentq(lambda t: at(t)[1], 4.0, 6.0)) < 1e-6


def test_a_motion_far_from_any_singularity_says_how_near_it_comes(planar):
    _, motion = swing(q2=(1.6, 1.2))
    report = singularities(planar, motion, directions=PLANE, base_mode="fixed")
    assert report.intervals == ()
    assert not report.near.any()
    assert abs(report.closest.time - 10.0) < 1e-6
    np.testing.assert_allclose(report.closest.smallest, closed_smallest(1.2), rtol=1e-9)
    assert "never falls below" in report.to_text()


def test_joints_that_stand_still_are_one_instant(planar):
    report = singularities(
        planar, Postures(np.arange(6.0), np.tile([1.0, 0.0], (6, 1))), directions=PLANE, base_mode="fixed"
    )
    (interval,) = report.intervals
    assert (interval.start, interval.end) == (0.0, 5.0)
    assert len(interval.points) == 1
    assert len(singularities(planar, Postures(np.zeros(1), np.ones((1, 2))), directions=PLANE).time) == 1


def test_three_links_for_two_directions_lose_rank_only_fully_stretched(robots):
    """The singular postures q2 = q3 = 0 are two conditions: their nearest is found in both at once."""
    q = np.array([[0.7, 0.1, -0.15]])
    report = singularities(
        robots["ye_2019_planar3"],
        Postures(np.zeros(1), q),
        directions=PLANE,
        base_mode="fixed",
        threshold=0.5,
    )
    point = report.closest
    assert report.determinant is None
    np.testing.assert_allclose(point.singular_posture, [0.7, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(point.posture_distance, np.hypot(0.1, 0.15), rtol=1e-6)


def test_a_direction_that_is_never_had_is_one_stretch(robots):
    """A planar arm never leaves its tilted plane: the determinant is rounding, whose sign says nothing."""
    tilt = np.tile([np.cos(0.35), np.sin(0.35), 0.0, 0.0], (31, 1))
    joints = np.array([0.5, 1.0, 0.7]) + np.linspace(0, 0.6, 31)[:, None]
    report = singularities(
        robots["ye_2019_planar3"],
        Postures(np.linspace(0, 3, 31), joints, base_quaternion=tilt),
        directions=("x", "y", "z"),
        base_mode="fixed",
    )
    (interval,) = report.intervals
    assert (interval.start, interval.end) == (0.0, 3.0)
    assert len(interval.points) == 1
    assert not interval.points[0].crossing
    np.testing.assert_allclose(
        np.abs(interval.points[0].lost_I[0]), [0, np.sin(0.7), np.cos(0.7), 0, 0, 0], atol=1e-9
    )
    assert interval.points[0].kind == "kinematic"


def test_two_joints_for_three_directions_never_lose_rank(planar):
    report = singularities(
        planar,
        Postures(np.zeros(1), np.array([[1.0, 0.3]])),
        directions=(*PLANE, "about_z"),
        base_mode="fixed",
        threshold=2.0,
    )
    point = report.closest
    assert report.singular_values.shape == (1, 2)
    assert (point.posture_distance, point.kind) == (None, "mixed")
    assert "no singular posture was found" in report.to_text()


def test_plain_values_for_a_file(floating_report):
    _, report = floating_report
    plain = json.loads(json.dumps(report.to_dict(), allow_nan=False))
    (interval,) = plain["intervals"]
    assert interval["points"][0]["kind"] == "dynamic"
    assert interval["points"][0]["lost_in_words"][0].startswith("moving along the tool's x, ")
    assert plain["closest"]["time"] == report.closest.time


def test_scan_of_a_grid_counts_what_the_closed_form_counts(planar):
    grid = grid_postures(planar, 21)
    assert grid.shape == (441, 2)
    scan = singularity_scan(planar, grid, directions=PLANE, base_mode="fixed", threshold=0.1)
    expected = closed_smallest(grid[:, 1])
    assert scan.share_near == np.mean(expected < 0.1)
    # Folded and stretched alike are where the smallest singular value vanishes: the cell around zero is hit.
    np.testing.assert_allclose(scan.smallest, 0.0, atol=1e-9)
    assert scan.kinematic == scan.classified > 0


def test_random_scan_is_seeded_and_estimates_the_share(planar):
    scan = singularity_scan(planar, 4000, seed=3, directions=PLANE, base_mode="fixed", threshold=0.2)
    angles = np.linspace(-np.pi, np.pi, 200001)
    expected = np.mean(closed_smallest(angles) < 0.2)
    assert abs(scan.share_near - expected) < 4 * scan.standard_error
    keywords = {"directions": PLANE, "base_mode": "fixed", "threshold": 0.2}
    assert singularity_scan(planar, 4000, seed=3, **keywords).to_dict() == scan.to_dict()
    assert singularity_scan(planar, 4000, seed=4, **keywords).smallest != scan.smallest


def test_dynamic_share_of_a_scan(planar):
    """Of postures near a zero of the closed form, those whose zero has |sin q2| beyond the bound are dynamic."""
    scan = singularity_scan(planar, 300, seed=1, directions=PLANE)
    assert scan.classified == round(300 * scan.share_near) == scan.kinematic + scan.dynamic + scan.mixed
    # The zeros of the closed form at all q1 on a grid, and the share of them beyond 10 deg, each q1 alike.
    zeros = []
    for q1 in np.linspace(-np.pi, np.pi, 201):
        for low, high in ((-1.0, 1.0), (np.pi - 1.0, np.pi + 1.0)):
            zeros.append(brentq(lambda q2, q1=q1: closed_determinant(q1, q2), low, high))
    share = np.mean(np.abs(np.sin(zeros)) > np.sin(np.deg2rad(10)))
    assert abs(scan.dynamic_share - share) < 4 * np.sqrt(share * (1 - share) / scan.classified)
    assert f"{scan.dynamic} near a dynamic one" in " ".join(scan.to_text().split())
