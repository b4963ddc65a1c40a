"""The rate inverses against NumPy, closed forms and differences, also at repeated and at zero singular values."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.tracking.damping import constant, gain, raised_cosine
from jffsr.tracking.inverses import (
    filtered_inverse,
    manipulability,
    manipulability_damping,
    null_space,
    rate_solution,
    transposed_rates,
)

LAMBDA, EPSILON = 0.0571, 0.0677
DAMPINGS = {"adaptive": raised_cosine(LAMBDA, EPSILON), "fixed": constant(0.05)}


def orthogonal(rng, n):
    return np.linalg.qr(rng.normal(size=(n, n)))[0]


def matrix(sigma, n, seed=0):
    """A matrix with these singular values, (m, n), in random bases."""
    rng, m = np.random.default_rng(seed), len(sigma)
    return orthogonal(rng, m) @ np.eye(m, n) @ np.diag([*sigma, *np.zeros(n - m)]) @ orthogonal(rng, n).T


def plain(jacobian, largest, epsilon):
    """The same by NumPy: J' (J J' + Lambda)^-1, Lambda the matrix function of J J'."""
    values, vectors = np.linalg.eigh(jacobian @ jacobian.T)
    sigma = np.sqrt(np.maximum(values, 0))
    damping = np.where(
        sigma < epsilon, 0.5 * largest * (1 + np.cos(np.pi * np.minimum(sigma / epsilon, 1))), 0
    )
    return jacobian.T @ vectors @ np.diag(1 / (sigma**2 + damping**2)) @ vectors.T


CASES = {
    "apart": ([2.0, 1.5, 0.7, 0.4, 0.05, 0.01], 6),
    "repeated": ([1.0, 1.0, 0.05, 0.05, 0.05, 0.02], 6),
    "nearly repeated": ([1.0, 1.0 - 1e-9, 0.05, 0.05 + 1e-12, 0.03, 0.03 + 1e-7], 6),
    "at the edge": ([1.0, EPSILON + 1e-6, EPSILON - 1e-6, 0.05, 0.04, 0.03], 6),
    "rank lost": ([1.0, 1.0, 0.5, 0.04, 1e-11, 0.0], 6),
    "rank lost twice": ([1.0, 0.7, 0.04, 0.0, 0.0, 0.0], 6),
    "wide": ([1.0, 1.0, 0.5, 0.05, 0.05, 0.0], 8),
    "five directions": ([1.0, 0.6, 0.6, 0.05, 0.02], 6),
}


@pytest.fixture(scope="module")
def compiled():
    @jax.jit
    def both(jacobian, direction, damping):
        return jax.jvp(lambda j: filtered_inverse(j, damping), (jacobian,), (direction,))

    return both


def central(function, jacobian, direction, step):
    """Derivative by Richardson's extrapolation of central differences."""

    def slope(h):
        return (function(jacobian + h * direction) - function(jacobian - h * direction)) / (2 * h)

    return (4 * slope(step / 2) - slope(step)) / 3


@pytest.mark.parametrize("kind", DAMPINGS)
@pytest.mark.parametrize("case", CASES)
def test_filtered_inverse_and_its_derivative(compiled, case, kind):
    sigma, n = CASES[case]
    jacobian = matrix(sigma, n)
    direction = np.random.default_rng(1).normal(size=jacobian.shape)
    value, slope = compiled(jacobian, direction, DAMPINGS[kind])
    if kind == "fixed":
        eye = np.eye(len(sigma))
        reference = lambda j: np.linalg.solve(j @ j.T + 0.05**2 * eye, j).T  # noqa: E731
    else:
        reference = partial(plain, largest=LAMBDA, epsilon=EPSILON)
    # eigh of J J' leaves half of the digits of a singular value at zero, where the gain's slope multiplies them.
    np.testing.assert_allclose(value, reference(jacobian), rtol=1e-9, atol=1e-9 / LAMBDA**2)
    expected = central(reference, jacobian, direction, 4e-5)
    np.testing.assert_allclose(slope, expected, rtol=2e-5, atol=2e-5 * np.abs(expected).max())


def test_derivative_has_no_rounding_of_near_singular_values(compiled):
    # The same direction at a repeated value and 1e-13 beside it: nothing may jump.
    direction = np.random.default_rng(2).normal(size=(6, 6))
    for apart in (1e-15, 1e-13, 1e-10):
        slopes = [
            compiled(matrix([1.0, 1.0 - d, 0.05, 0.05 - d, d, 0.0], 6), direction, DAMPINGS["adaptive"])[1]
            for d in (0.0, apart)
        ]
        np.testing.assert_allclose(*slopes, rtol=1e-6, atol=1e-6 * np.abs(slopes[0]).max())


def test_derivative_by_the_numbers_of_the_damping():
    jacobian = matrix([1.0, 0.06, 0.06, 0.03, 0.01, 0.0], 6)
    weight = np.random.default_rng(3).normal(size=(6, 6))

    def total(numbers):
        return jnp.sum(weight * filtered_inverse(jacobian, raised_cosine(*numbers)))

    def plainly(numbers):
        return np.sum(weight * plain(jacobian, *numbers))

    numbers = np.array([LAMBDA, EPSILON])
    found = jax.grad(total)(jnp.asarray(numbers))
    for axis in range(2):
        step = 1e-6 * np.eye(2)[axis]
        expected = (plainly(numbers + step) - plainly(numbers - step)) / 2e-6
        np.testing.assert_allclose(found[axis], expected, rtol=1e-6)


def test_plain_inverse_is_the_inverse_and_the_pseudo_inverse_with_their_derivatives(compiled):
    none = constant(0.0)
    rng = np.random.default_rng(4)
    for jacobian in (rng.normal(size=(6, 6)), rng.normal(size=(6, 7)), rng.normal(size=(6, 3))):
        direction = rng.normal(size=jacobian.shape)
        value, slope = compiled(jacobian, direction, none)
        np.testing.assert_allclose(value, np.linalg.pinv(jacobian), rtol=1e-11, atol=1e-12)
        expected = central(np.linalg.pinv, jacobian, direction, 1e-4)
        np.testing.assert_allclose(slope, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())


def test_plain_inverse_leaves_lost_directions_alone(compiled):
    # A planar arm: rank 2 in six directions whatever it does; the change keeps the rank.
    rng = np.random.default_rng(5)
    left, right = rng.normal(size=(6, 2)), rng.normal(size=(2, 4))
    turned = rng.normal(size=(2, 4))
    value, slope = compiled(left @ right, left @ turned, constant(0.0))
    np.testing.assert_allclose(value, np.linalg.pinv(left @ right, rcond=1e-10), rtol=1e-10, atol=1e-12)
    expected = central(lambda j: np.linalg.pinv(j, rcond=1e-9), left @ right, left @ turned, 1e-3)
    np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_peak_gains_of_the_published_damping():
    sigma = jnp.linspace(1e-4, 0.2, 200_001)
    gains = gain(sigma, DAMPINGS["adaptive"])
    assert abs(float(gains.max()) - 20.2) < 0.05
    assert abs(float(sigma[jnp.argmax(gains)]) - 0.0437) < 1e-4
    assert abs(float(gain(jnp.asarray(EPSILON), DAMPINGS["adaptive"])) - 1 / EPSILON) < 1e-12
    # Of plain damping: 1 / (2 lambda) at sigma = lambda.
    fixed = gain(sigma, constant(LAMBDA))
    assert abs(float(fixed.max()) - 1 / (2 * LAMBDA)) < 1e-6
    assert abs(float(sigma[jnp.argmax(fixed)]) - LAMBDA) < 1e-6


def test_manipulability_and_its_damping():
    jacobian = matrix([1.0, 0.5, 0.5, 0.2, 0.1, 0.04], 7)
    product = np.sqrt(np.linalg.det(jacobian @ jacobian.T))
    assert abs(float(manipulability(jacobian)) - product) < 1e-15
    assert float(manipulability_damping(jacobian, 0.1, 0.5 * product)) == 0.0
    assert abs(float(manipulability_damping(jacobian, 0.1, 4 * product)) - 0.075) < 1e-12
    slope = jax.grad(lambda j: manipulability_damping(j, 0.1, 1.0))(
        jnp.asarray(matrix([1, 1, 0.5, 0.5, 0.1, 0.0], 6))
    )
    assert np.all(np.isfinite(slope))
    assert np.any(slope != 0)


def test_null_space_passes_what_the_task_does_not_see():
    jacobian = matrix([1.0, 0.8, 0.5, 0.3, 0.2, 0.1], 7)
    space = np.asarray(null_space(jacobian, DAMPINGS["adaptive"]))
    np.testing.assert_allclose(jacobian @ space, 0.0, atol=1e-14)
    np.testing.assert_allclose(space @ space, space, atol=1e-13)
    assert abs(np.trace(space) - 1) < 1e-12


def test_transposed_rates_are_the_best_multiple_of_the_transpose():
    jacobian, velocity = matrix([1.0, 0.8, 0.5, 0.3, 0.2, 0.1], 6), np.random.default_rng(6).normal(size=6)
    rates = np.asarray(transposed_rates(jacobian, velocity))
    direction = jacobian.T @ velocity
    scales = np.linspace(0, 10, 100_001)
    errors = np.linalg.norm(velocity[:, None] - np.outer(jacobian @ direction, scales), axis=0)
    np.testing.assert_allclose(
        rates, scales[np.argmin(errors)] * direction, atol=1e-4 * np.abs(direction).max()
    )
    slope = jax.jacobian(lambda v: transposed_rates(jacobian, v))(jnp.zeros(6))
    assert np.all(np.isfinite(slope))


def test_inverses_work_on_batches():
    stack = jnp.asarray(np.stack([matrix([1, 1, 0.5, 0.05, 0.05, 0.0], 6, seed) for seed in range(3)]))
    velocity = jnp.ones(6)
    for method in ("adaptive", "transpose"):
        one = [rate_solution(method, j, velocity, DAMPINGS["adaptive"]) for j in stack]
        many = jax.vmap(lambda j, m=method: rate_solution(m, j, velocity, DAMPINGS["adaptive"]))(stack)
        np.testing.assert_allclose(many, np.stack(one), rtol=1e-10, atol=1e-12)
