"""The sine-polynomial joint law: boundary conditions, derivatives, limits, the paper's own form, refusals."""

from __future__ import annotations

import dataclasses

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.trajectories.interface import PlannedTrajectory
from jffsr.trajectories.sine_polynomial import SinePolynomial

LOWER, UPPER = np.array([-2.0, -1.0, 0.1]), np.array([3.0, 1.5, 4.0])
START, GOAL = np.array([-1.5, 1.2, 0.3]), np.array([2.5, -0.5, 3.9])
DURATION = 7.0


@pytest.fixture(scope="module")
def laws():
    """200 trajectories that differ in their free numbers, as one batched pytree."""
    base = SinePolynomial.between(START, GOAL, LOWER, UPPER, DURATION)
    free = np.random.default_rng(4).uniform(-np.pi, np.pi, (200, 6))
    return jax.vmap(base.with_free)(free)


@jax.jit
def _sample(laws, times):
    return jax.vmap(lambda law: jax.vmap(law)(times))(laws)


@jax.jit
def _derivatives(laws, times):
    """Rate and acceleration by differentiating the position that the law returns."""

    def position(law, time):
        return law(time)[0]

    def rate(law, time):
        return jax.jvp(lambda t: position(law, t), (time,), (jnp.ones_like(time),))[1]

    def both(law, time):
        return jax.jvp(lambda t: rate(law, t), (time,), (jnp.ones_like(time),))

    return jax.vmap(lambda law: jax.vmap(lambda t: both(law, t))(times))(laws)


def test_boundary_conditions_hold_whatever_the_free_numbers(laws):
    q, qd, qdd = _sample(laws, np.array([0.0, DURATION]))
    np.testing.assert_allclose(q[:, 0], np.tile(START, (200, 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(q[:, 1], np.tile(GOAL, (200, 1)), rtol=0, atol=1e-12)
    np.testing.assert_allclose(qd, 0, atol=1e-12)
    np.testing.assert_allclose(qdd, 0, atol=1e-12)


def test_limits_hold_whatever_the_free_numbers(laws):
    q, qd, qdd = _sample(laws, np.linspace(0, DURATION, 201))
    chex.assert_tree_all_finite((q, qd, qdd))
    assert np.all(q >= LOWER - 1e-15)
    assert np.all(q <= UPPER + 1e-15)
    assert np.max(q - UPPER) > -0.01, "the free numbers never come near a limit: the test shows nothing"


def test_rates_and_accelerations_are_the_derivatives(laws):
    times = np.linspace(0, DURATION, 23)
    _, qd, qdd = _sample(laws, times)
    rate, acceleration = _derivatives(laws, times)
    np.testing.assert_allclose(qd, rate, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(qdd, acceleration, rtol=1e-10, atol=1e-10)


def test_rates_are_finite_differences(laws):
    """The same without automatic differentiation."""
    h, times = 1e-4, np.linspace(0.5, DURATION - 0.5, 7)
    (before, rate_before, _), (_, qd, qdd), (after, rate_after, _) = (
        _sample(laws, times + shift) for shift in (-h, 0, h)
    )
    np.testing.assert_allclose((after - before) / (2 * h), qd, rtol=0, atol=1e-5)
    np.testing.assert_allclose((rate_after - rate_before) / (2 * h), qdd, rtol=0, atol=1e-5)


def _dimensional(a6, a7, corrected=True):
    """Equation (46) of Li 2022 in powers of t, with the sign of a4 as corrected or as printed."""
    half, middle, t = (UPPER - LOWER) / 2, (UPPER + LOWER) / 2, DURATION
    u0, u1 = np.arcsin((START - middle) / half), np.arcsin((GOAL - middle) / half)
    d = u1 - u0
    a3 = 10 * d / t**3 - a6 * t**3 - 3 * a7 * t**4
    a4 = (-15 if corrected else 15) * d / t**4 + 3 * a6 * t**2 + 8 * a7 * t**3
    a5 = 6 * d / t**5 - 3 * a6 * t - 6 * a7 * t**2
    coefficients = [u0, 0 * u0, 0 * u0, a3, a4, a5, a6, a7]

    def phase(time):
        return sum(a * time**k for k, a in enumerate(coefficients))

    return phase, lambda time: middle + half * np.sin(phase(time)), d, u1


def test_the_papers_form_with_corrected_coefficients_is_the_same_law():
    """64 alpha = a + 3.5 b and 64 beta = b/2, where a = a6 T^6 and b = a7 T^7."""
    a, b = np.array([20.0, -50.0, 7.0]), np.array([-30.0, 11.0, 60.0])
    _, position, _, _ = _dimensional(a / DURATION**6, b / DURATION**7)
    law = SinePolynomial.between(
        START, GOAL, LOWER, UPPER, DURATION, coefficients=np.stack([(a + 3.5 * b) / 64, b / 128], axis=1)
    )
    times = np.linspace(0, DURATION, 41)
    expected = np.array([position(t) for t in times])
    np.testing.assert_allclose(jax.vmap(law)(times)[0], expected, rtol=0, atol=1e-12)


def test_the_printed_sign_misses_the_end_by_thirty_times_the_change():
    phase, _, change, end = _dimensional(np.zeros(3), np.zeros(3), corrected=False)
    np.testing.assert_allclose(phase(DURATION) - end, 30 * change, rtol=1e-13)
    phase, _, _, end = _dimensional(np.zeros(3), np.zeros(3))
    np.testing.assert_allclose(phase(DURATION), end, rtol=0, atol=1e-14)


def test_free_numbers_round_trip():
    law = SinePolynomial.between(START, GOAL, LOWER, UPPER, DURATION, box=2.0)
    assert isinstance(law, PlannedTrajectory)
    low, high = law.free_bounds()
    np.testing.assert_array_equal(low, np.full(6, -2.0))
    np.testing.assert_array_equal(high, np.full(6, 2.0))
    free = np.arange(6.0)
    moved = law.with_free(free)
    np.testing.assert_array_equal(moved.coefficients, [[0, 3], [1, 4], [2, 5]])
    assert moved.duration == DURATION
    chex.assert_trees_all_equal(moved.with_free(np.zeros(6)), law)


def test_the_duration_may_be_free():
    law = SinePolynomial.between(START, GOAL, LOWER, UPPER, DURATION, duration_bounds=(5.0, 9.0))
    low, high = law.free_bounds()
    chex.assert_shape([low, high], (7,))
    assert (low[-1], high[-1]) == (5, 9)
    moved = law.with_free(np.array([0.1] * 6 + [8.0]))
    assert moved.duration == 8
    q, qd, qdd = moved(8.0)
    np.testing.assert_allclose(q, GOAL, rtol=0, atol=1e-12)
    np.testing.assert_allclose((qd, qdd), 0, atol=1e-12)


def test_gradients_with_respect_to_everything_are_finite():
    law = SinePolynomial.between(START, GOAL, LOWER, UPPER, DURATION, duration_bounds=(5.0, 9.0))

    def loss(law):
        return sum(jnp.sum(x**2) for x in law(0.3 * law.duration))

    gradient = jax.jit(jax.grad(loss))(law)
    chex.assert_tree_all_finite(gradient)
    assert np.all(np.abs(gradient.coefficients) > 0)
    assert gradient.duration != 0


def _refused(match, **changes):
    arguments = {"start": START, "goal": GOAL, "lower": LOWER, "upper": UPPER, "duration": DURATION} | changes
    names = ["shoulder", "elbow", "wrist"]
    with pytest.raises(InputError, match=match):
        SinePolynomial.between(**arguments, joint_names=names)


def test_a_start_or_goal_on_a_limit_is_refused_by_joint():
    """arcsin has no derivative there."""
    _refused(r"shoulder: start -2 lies on the position limits \[-2, 3\]", start=[-2.0, 1.2, 0.3])
    _refused(r"wrist: goal 4 lies on the position limits \[0.1, 4\]", goal=[2.5, -0.5, 4.0])
    _refused(r"elbow: goal 1.5 lies on the position limits", goal=[2.5, 1.5 - 1e-10, 3.9])


def test_a_start_or_goal_outside_the_limits_is_refused_by_joint():
    _refused(r"elbow: start 1.7 lies outside the position limits \[-1, 1.5\]", start=[-1.5, 1.7, 0.3])
    _refused(r"shoulder: goal nan lies outside", goal=[np.nan, -0.5, 3.9])


def test_infinite_limits_are_refused_by_joint():
    _refused(
        r"wrist: the sine-polynomial law needs finite position limits, found \[0.1, inf\]",
        upper=[3.0, 1.5, np.inf],
    )


def test_wrong_sizes_and_durations_are_refused():
    _refused(r"goal has 2 numbers; the robot has 3 joints", goal=[0.0, 0.0])
    _refused(r"upper limit has 2 numbers; the robot has 3 joints", upper=[3.0, 1.5])
    _refused(r"coefficients have the shape \(2, 3\); \(3, 2\) is expected", coefficients=np.zeros((2, 3)))
    _refused(r"duration bounds are \[9, 5\] s; they must be positive", duration_bounds=(9.0, 5.0))
    _refused(r"duration bounds are \[0, 5\] s; they must be positive", duration_bounds=(0.0, 5.0))
    _refused(r"duration is 0 s; it must be positive and finite", duration=0.0)
    _refused(r"duration is nan s", duration=np.nan)
    _refused(r"duration is inf s", duration=np.inf)


def test_without_names_joints_are_numbered():
    with pytest.raises(InputError, match="joint 1: start"):
        SinePolynomial.between([0.0, 2.0], [0.0, 0.0], [-1.0, -1.0], [1.0, 1.0], 1.0)


def test_it_is_a_pytree_of_numbers():
    law = SinePolynomial.between(START, GOAL, LOWER, UPPER, DURATION)
    assert len(jax.tree.leaves(law)) == len(dataclasses.fields(law)) - 1
    chex.assert_trees_all_equal(jax.jit(lambda x: x)(law), law)


def test_a_grid_of_times_is_the_same_times_one_by_one(laws):
    law, times = jax.tree.map(lambda x: x[0], laws), np.linspace(0, DURATION, 9)
    together, apart = jax.jit(lambda law: (law.on_grid(times), [law(time) for time in times]))(law)
    for kind in range(3):
        chex.assert_shape(together[kind], (3, 9))
        one_by_one = np.stack([sample[kind] for sample in apart], axis=-1)
        np.testing.assert_allclose(together[kind], one_by_one, atol=1e-14)
