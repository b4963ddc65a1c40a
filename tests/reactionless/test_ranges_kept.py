"""Joints led off the ends of their ranges: the least-squares problem itself, the base, the rate limits, a hold."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jffsr
from jffsr.reactionless.estimation.adaptive import AdaptiveCode, AdaptiveReactionless
from jffsr.reactionless.estimation.balance import Load
from jffsr.reactionless.estimation.commanded import LoadHistory, commanded_run
from jffsr.reactionless.estimation.excitation import SineSum
from jffsr.reactionless.estimation.models import KnownLoad
from jffsr.reactionless.interface import Measured
from jffsr.reactionless.ranges import RangesKept
from jffsr.study.config import load_config
from jffsr.study.reactionless.holding import ranges_kept

PERIOD = 0.02
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
SPATIAL = jffsr.load_robot("servicer_7dof")
LOWER, UPPER = (np.asarray(getattr(SPATIAL.limits, f"position_{end}")) for end in ("lower", "upper"))
MIDDLE, HALF = (UPPER + LOWER) / 2, (UPPER - LOWER) / 2
# Three joints at or beyond an end, the others well inside.
SHARE = np.array([0.97, -0.2, 0.4, -1.0, 0.1, 1.04, 0.5])
KEPT = RangesKept()


def planar(upper: float = np.inf):
    """Ye's arm, which has no ranges, with one of as much to both sides."""
    bare = jffsr.load_robot("ye_2019_planar3")
    return bare.replace(limits=jffsr.Limits.symmetric(3, position=upper))


def test_nothing_is_wanted_away_from_the_ends():
    inside = MIDDLE + 0.899 * HALF * np.array([1, -1, 1, -1, 0, 0.5, 1])
    rates, weight = KEPT.wanted(SPATIAL.limits, inside)
    np.testing.assert_array_equal(rates, 0.0)
    np.testing.assert_array_equal(weight, 0.0)
    rates, weight = KEPT.wanted(planar().limits, np.array([1e3, -1e3, 0.0]))
    np.testing.assert_array_equal(rates, 0.0)
    np.testing.assert_array_equal(weight, 0.0)


@pytest.mark.parametrize("share", [0.95, 1.0, 1.3])
def test_near_both_ends_joints_are_led_back(share):
    """At the gain times the way beyond where it begins, with a weight that is the full one from the end on."""
    for sign in (1.0, -1.0):
        rates, weight = KEPT.wanted(SPATIAL.limits, MIDDLE + sign * share * HALF)
        np.testing.assert_allclose(rates, -sign * 0.2 * (share - 0.9) * HALF, rtol=1e-12)
        np.testing.assert_allclose(weight, 50.0 if share == 0.95 else 100.0, rtol=1e-12)


def projector(seed: int = 4):
    """Of the null space of three random rows, by the textbook's formula."""
    a = np.random.default_rng(seed).normal(size=(3, 7))
    return a, np.eye(7) - a.T @ np.linalg.inv(a @ a.T) @ a


def corrected(q, rates, space):
    gain, wanted = KEPT.correction(SPATIAL.limits, q, space)
    return rates + gain @ (wanted - rates)


def test_the_correction_solves_the_least_squares_problem():
    """All that moves within the null space, stacked and solved by an orthogonal factorisation."""
    a, space = projector()
    rates = np.random.default_rng(5).normal(size=7)
    q = MIDDLE + SHARE * HALF
    found = np.asarray(corrected(jnp.asarray(q), rates, jnp.asarray(space)))
    np.testing.assert_allclose(a @ found, a @ rates, atol=1e-13)
    wanted, weight = (np.asarray(x) for x in KEPT.wanted(SPATIAL.limits, q))
    root = np.sqrt(weight)[:, None]
    rows = np.concatenate([root * space, space])
    right = np.concatenate([root[:, 0] * (wanted - rates), np.zeros(7)])
    best = rates + space @ np.linalg.lstsq(rows, right, rcond=1e-12)[0]
    np.testing.assert_allclose(found, best, atol=1e-11)
    # Joints at an end no longer run outwards as they did.
    near = np.abs(SHARE) > 0.95
    assert np.all(np.abs(found - wanted)[near] < 0.2 * np.abs(rates - wanted)[near].max())


@pytest.mark.parametrize("beyond", [0.0, 0.05, 0.5])
def test_derivatives_are_differences_also_over_the_limit(beyond):
    _, space = projector()
    rates = np.random.default_rng(6).normal(size=7)
    run = jax.jit(lambda q: corrected(q, rates, jnp.asarray(space)))
    # A little off the end itself, where the weight's second derivative jumps.
    at = MIDDLE + (SHARE + np.sign(SHARE) * (beyond + 1e-3) * (np.abs(SHARE) > 0.95)) * HALF
    h = 1e-6
    differences = np.stack([(run(at + h * e) - run(at - h * e)) / (2 * h) for e in np.eye(7)], axis=1)
    slope = np.asarray(jax.jacfwd(run)(jnp.asarray(at)))
    np.testing.assert_allclose(slope, differences, atol=1e-6)
    assert np.abs(slope).max() > 1e-2
    for place in (KEPT.begin, 1.0):
        assert np.all(np.isfinite(jax.jacfwd(run)(jnp.asarray(MIDDLE + place * HALF))))


def step(robot, mass, q, momentum, ranges, axes, rate_limit=np.inf):
    """State and motion of one sample of a reference that knows the load, without and with the ranges."""
    load = Load(jnp.array(mass), jnp.array([0.3, 0.05, 0.0]), jnp.diag(jnp.array([8.0, 10.0, 13.0])))
    n = robot.num_joints
    start = Measured(UPRIGHT, np.zeros(3), np.zeros(6), q, np.zeros(n), np.array(True))

    @jax.jit
    def both(limit):
        found = []
        for kept in (None, ranges):
            model = KnownLoad(load, momentum)
            reference = AdaptiveReactionless(
                robot, model, PERIOD, SineSum.spread(n), limit, ranges=kept, axes=axes
            )
            found.append(reference.advance(reference.begin(start), 1.3, start))
        return found

    (_, without), (state, desired) = both(rate_limit)
    return state, np.asarray(without.joint_velocity), np.asarray(desired.joint_velocity)


def turning(robot, mass, q, momentum, rates):
    """The base's angular velocity (3,), by the momentum of robot and load as one robot."""
    body = jffsr.RigidBody(mass, np.zeros(3), np.diag([8.0, 10.0, 13.0]))
    whole = jffsr.weld(robot, body, position=(0.3, 0.05, 0.0))
    kin = jffsr.kinematics(whole, jffsr.State(np.zeros(3), UPRIGHT, q))
    return np.asarray(jffsr.base_twist(whole, kin, rates, np.concatenate([np.zeros(3), momentum])))[3:]


CASES = {
    "seven axes": (SPATIAL, 200.0, MIDDLE + SHARE * HALF, np.array([0.4, -0.7, 0.3]), (0, 1, 2)),
    "planar": (planar(1.0), 5.0, np.array([1.04, -0.5, 0.7]), np.array([0.0, 0.0, 1.25]), (2,)),
}


@pytest.mark.parametrize("name", CASES)
def test_the_base_feels_nothing_of_it(name):
    robot, mass, q, momentum, axes = CASES[name]
    _, without, rates = step(robot, mass, q, momentum, KEPT, axes)
    assert np.abs(turning(robot, mass, q, momentum, 0 * rates)).max() > 1e-5
    assert np.abs(turning(robot, mass, q, momentum, without)).max() < 1e-12
    assert np.abs(turning(robot, mass, q, momentum, rates)).max() < 1e-12
    assert np.abs(rates - without).max() > 1e-3


@pytest.mark.parametrize("name", [pytest.param("seven axes", marks=pytest.mark.slow), "planar"])
def test_rate_limits_come_before_the_ranges(name):
    """The momentum is absorbed in full, and what leads the joints back is only as fast as the limits leave room for."""
    robot, mass, q, momentum, axes = CASES[name]
    eager = replace(KEPT, gain=50.0)
    _, _, free = step(robot, mass, q, momentum, eager, axes)
    limit = 0.3 * float(np.abs(free).max())
    state, _, rates = step(robot, mass, q, momentum, eager, axes, limit)
    # The excitation may draw the joint that decides a little off its limit.
    assert 0.9 * limit < np.abs(rates).max() < limit * (1 + 1e-12)
    assert int(state.code) == AdaptiveCode.HELD
    assert np.abs(turning(robot, mass, q, momentum, rates)).max() < 1e-12
    # The first joint is beyond where it begins, and led back all the same.
    assert rates[0] < 0


@pytest.mark.slow
def test_a_hold_that_left_a_range_stays_inside():
    """Sixteen seconds of the published arm with its load, the momentum pushing a joint to the end 0.03 rad away."""
    load, momentum = (
        Load(jnp.array(5.0), jnp.array([0.1, 0.0, 0.0]), 2.5 * jnp.eye(3)),
        jnp.array([0, 0, 1.25]),
    )
    robot, start = planar(1.0), jnp.array([0.97, -0.5, 0.7])

    @jax.jit
    def run():
        found = []
        for ranges in (None, KEPT):
            model = KnownLoad(load, momentum)
            reference = AdaptiveReactionless(
                robot, model, PERIOD, SineSum.spread(3, 0.02), rate_limit=0.3, ranges=ranges, axes=(2,)
            )
            history = LoadHistory(load, load, jnp.inf, momentum)
            found.append(commanded_run(robot, history, reference, start, jnp.zeros(3), PERIOD, 800))
        return found

    without, kept = run()
    assert np.abs(without.joint_position).max() > 1.02
    assert np.abs(kept.joint_position).max() < 0.99
    for found in (without, kept):
        assert np.abs(found.base_rate[10:, 2]).max() < 1e-4
        np.testing.assert_array_equal(found.states.code, AdaptiveCode.HELD)


def test_a_study_has_it_where_there_are_ranges():
    chain = load_config("tumbling_capture", ["hold.ranges.begin=0.8"])
    assert ranges_kept(chain.hold, SPATIAL) == RangesKept(0.8, 0.2)
    assert ranges_kept(load_config("tumbling_capture", ["hold.ranges=null"]).hold, SPATIAL) is None
    published = load_config("ye_2019")
    assert published.hold.ranges is not None
    assert ranges_kept(published.hold, jffsr.load_robot("ye_2019_planar3")) is None
