"""Rounded peaks, hinges and norms against the plain ones."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.objectives.smoothing import Smoothing, overrun, smooth_error_norm, smooth_overrun
from jffsr.spatial.rotation import (
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
    rounded_rotation_vector,
)
from jffsr.spatial.safe import peak

RNG = np.random.default_rng(3)
VALUES = RNG.normal(size=(21, 4))
LIMIT = np.array([0.5, 1.0, 2.0, np.inf])


def test_overrun_is_the_sum_of_relative_peaks_over_their_limits():
    expected = sum(max(0.0, (np.abs(VALUES[:, j]).max() - LIMIT[j]) / LIMIT[j]) for j in range(3))
    assert overrun(VALUES, LIMIT) == pytest.approx(expected, rel=1e-14)


def test_infinite_limits_give_zero():
    assert overrun(VALUES, np.full(4, np.inf)) == 0.0
    assert smooth_overrun(VALUES, np.full(4, np.inf), Smoothing()) < 1e-12


def test_rounding_shrinks_with_its_widths():
    """Halving the widths halves what is lost, down to nothing."""
    error = np.array([0.01, -0.02, 0.005])
    plain = overrun(VALUES, LIMIT), np.linalg.norm(error)
    widths = Smoothing(norm=0.5, peak=0.05, overrun=0.05)
    differences = []
    for factor in (1.0, 0.5, 0.25, 0.125, 1e-6):
        narrow = Smoothing(*(factor * w for w in (widths.norm, widths.peak, widths.overrun)))
        differences.append(
            [
                abs(smooth_overrun(VALUES, LIMIT, narrow) - plain[0]),
                abs(smooth_error_norm(error, 0.01, narrow) - plain[1]),
            ]
        )
    differences = np.array(differences)
    assert np.all(differences[1:] < 0.6 * differences[:-1])
    assert np.all(differences[-1] < 1e-6 * np.array([differences[0][0], 1.0]) + 1e-8)


def test_rounded_overrun_is_never_below_the_plain_one():
    for scale in (0.1, 0.5, 1.0, 2.0):
        values = scale * VALUES
        assert smooth_overrun(values, LIMIT, Smoothing()) >= overrun(values, LIMIT)


def test_looseness_widens_the_norm_with_its_square():
    loose = Smoothing(0.5, 1e-3, 2e-3).loosened(10.0)
    assert (loose.norm, loose.peak, loose.overrun) == pytest.approx((50.0, 1e-2, 2e-2))
    same = Smoothing().loosened(1.0)
    assert (same.norm, same.peak, same.overrun) == pytest.approx((0.5, 2e-3, 2e-3))


def test_gradient_of_a_peak_goes_to_one_place():
    x = jnp.array([[1.0, 2.0], [3.0, 2.0], [3.0, -1.0]])
    np.testing.assert_array_equal(peak(x), [3.0, 2.0])
    gradient = jax.grad(lambda x: jnp.sum(peak(x) * jnp.array([1.0, 10.0])))(x)
    np.testing.assert_array_equal(gradient, [[0.0, 10.0], [1.0, 0.0], [0.0, 0.0]])
    assert jnp.isnan(peak(jnp.array([1.0, jnp.nan, 0.0])))


def test_rotation_vector_rounded_at_180_deg():
    """The length is smooth through 180 degrees, where it is pi less twice the width; elsewhere it hardly differs."""
    axis, width = np.array([0.6, -0.64, 0.48]), 1e-3

    @jax.jit
    def length(angle):
        q = rotation_vector_to_quaternion(angle * jnp.asarray(axis))
        return jnp.linalg.norm(rounded_rotation_vector(q, width))

    assert length(np.pi) == pytest.approx(np.pi - 2 * width, abs=1e-8)
    slope_of = jax.jit(jax.grad(length))
    assert slope_of(np.pi) == pytest.approx(0.0, abs=1e-8)
    for turn in (-1e-3, 1e-4, 2e-3):
        h = 1e-6
        slope = (length(np.pi + turn + h) - length(np.pi + turn - h)) / (2 * h)
        assert slope_of(np.pi + turn) == pytest.approx(float(slope), abs=1e-5)
    small = rotation_vector_to_quaternion(jnp.array([[0.1, 0.2, -0.05], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]))
    np.testing.assert_allclose(
        rounded_rotation_vector(small, width), quaternion_to_rotation_vector(small), rtol=2e-6, atol=1e-15
    )
