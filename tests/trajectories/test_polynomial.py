"""The polynomial joint law: ends, derivatives, meaning of the free numbers, refusals."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.trajectories.interface import PlannedTrajectory
from jffsr.trajectories.polynomial import Polynomial

START, GOAL = np.array([-1.5, 1.2, 0.3]), np.array([2.5, -0.5, 3.9])
ENDS = {
    "start_rate": np.array([0.3, -0.2, 0.0]),
    "goal_rate": np.array([-0.1, 0.4, 0.25]),
    "start_acceleration": np.array([0.05, 0.0, -0.3]),
    "goal_acceleration": np.array([-0.2, 0.15, 0.1]),
}
DURATION = 7.0
DEGREES = (5, 6, 7, 9, 12)


def random_law(degree, **ends):
    law = Polynomial.between(START, GOAL, DURATION, degree, **ends)
    free = np.random.default_rng(degree).uniform(-2, 2, 3 * (degree - 5))
    return law.with_free(free)


@jax.jit
def sample(law, times):
    return law.on_grid(times)


@pytest.mark.parametrize("degree", DEGREES)
def test_every_curve_is_the_polynomial_of_its_degree_and_so_are_its_derivatives(degree):
    """numpy's polynomial through as many points as it has coefficients, and its derivatives, everywhere else."""
    law = random_law(degree, **ENDS)
    assert law.degree == degree
    nodes = DURATION / 2 * (1 + np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1)))
    times = np.linspace(0, DURATION, 41)
    at_nodes = np.asarray(sample(law, nodes)[0])
    found = [np.asarray(x) for x in sample(law, times)]
    for joint in range(3):
        curve = np.polynomial.Polynomial.fit(nodes, at_nodes[joint], degree, domain=[0, DURATION])
        for order, values in enumerate(found):
            expected = curve.deriv(order)(times) if order else curve(times)
            np.testing.assert_allclose(values[joint], expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("degree", DEGREES)
def test_the_ends_are_met_whatever_the_free_numbers(degree):
    for ends in ({}, ENDS):
        law = random_law(degree, **ends)
        found = [np.asarray(x) for x in sample(law, np.array([0.0, DURATION]))]
        for index, end in enumerate(law.boundary()):
            for values, asked in zip(found, end, strict=True):
                np.testing.assert_allclose(values[:, index], asked, rtol=0, atol=1e-13)


def test_the_first_free_number_is_the_deviation_half_way_and_each_is_its_largest():
    plain, times = Polynomial.between(START, GOAL, DURATION, 9), np.linspace(0, DURATION, 4001)
    middle = sample(plain, times)[0]
    for index in range(12):
        moved = sample(plain.with_free(np.eye(12)[index]), times)[0] - middle
        moment, joint = divmod(index, 3)
        others = np.delete(np.arange(3), joint)
        assert np.all(moved[others] == 0)
        np.testing.assert_allclose(np.max(np.abs(moved[joint])), 1, rtol=0, atol=1e-6)
        np.testing.assert_allclose(moved[joint, 2000], float(moment == 0), rtol=0, atol=1e-13)


def test_free_numbers_and_the_duration_round_trip():
    law = Polynomial.between(START, GOAL, DURATION, 8, box=1.5, duration_bounds=(5.0, 9.0))
    assert isinstance(law, PlannedTrajectory)
    low, high = law.free_bounds()
    np.testing.assert_array_equal(low, [-1.5] * 9 + [5])
    np.testing.assert_array_equal(high, [1.5] * 9 + [9])
    moved = law.with_free(np.append(np.arange(9.0), 8.0))
    np.testing.assert_array_equal(moved.coefficients, [[0, 3, 6], [1, 4, 7], [2, 5, 8]])
    assert moved.duration == 8
    np.testing.assert_allclose(moved(8.0)[0], GOAL, rtol=0, atol=1e-13)
    np.testing.assert_allclose(moved(8.0)[1:], 0, rtol=0, atol=1e-13)
    fixed = Polynomial.between(START, GOAL, DURATION, 6)
    assert fixed.with_free(np.ones(3)).duration == DURATION
    np.testing.assert_array_equal(fixed.free_bounds()[1], [2.0] * 3)


def test_one_time_and_a_grid_of_times_agree():
    law, times = random_law(7, **ENDS), np.linspace(0, DURATION, 5)
    one_by_one = jax.vmap(law, out_axes=-1)(times)
    chex.assert_trees_all_close(one_by_one, sample(law, times), rtol=0, atol=2e-14)


def test_gradients_with_respect_to_everything_are_finite():
    law = Polynomial.between(START, GOAL, DURATION, 7, duration_bounds=(5.0, 9.0))

    def loss(law):
        return sum(jnp.sum(x**2) for share in (0.0, 0.5, 1.0) for x in law(share * law.duration))

    chex.assert_tree_all_finite(jax.grad(loss)(law))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"goal": [1, 2]}, "goal has 2 numbers; start has 3"),
        ({"degree": 4}, "degree is 4; a whole number of at least 5"),
        ({"degree": 6.5}, "degree is 6.5; a whole number"),
        ({"duration": 0}, "duration is 0 s; it must be positive"),
        ({"duration_bounds": (3, 2)}, "duration bounds are"),
        ({"box": np.inf}, "box is inf; it must be positive and finite"),
        ({"goal_rate": [0, np.nan, 0]}, "goal rate is"),
        ({"start_rate": np.zeros((3, 1))}, "start rate has the shape"),
        ({"coefficients": np.zeros((3, 4))}, "coefficients have the shape"),
    ],
)
def test_refusals(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        Polynomial.between(**{"start": START, "goal": GOAL, "duration": DURATION, **changes})
