"""Values and gradients of the safe functions where the plain ones give NaN, and elsewhere."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.spatial.safe import safe_atan2, safe_norm, safe_sqrt, smooth_hinge, smooth_max, smooth_norm


def test_the_plain_functions_do_fail():
    """Were this not so, the safe ones would have no reason to be."""
    assert np.isnan(jax.grad(jnp.linalg.norm)(np.zeros(3))).all()


@pytest.mark.parametrize("wrap", [lambda f: f, jax.jit])
def test_gradients_at_zero_are_zero(wrap):
    np.testing.assert_array_equal(jax.grad(wrap(safe_norm))(np.zeros(3)), np.zeros(3))
    assert wrap(safe_norm)(np.zeros(3)) == 0
    assert jax.grad(wrap(safe_sqrt))(0.0) == 0
    assert wrap(safe_sqrt)(0.0) == 0
    assert jax.grad(wrap(safe_atan2), (0, 1))(0.0, 0.0) == (0, 0)
    assert wrap(safe_atan2)(0.0, 0.0) == 0


def test_forward_and_second_derivatives_are_finite_at_zero():
    chex.assert_tree_all_finite(jax.jacfwd(safe_norm)(np.zeros(3)))
    chex.assert_tree_all_finite(jax.hessian(safe_norm)(np.zeros(3)))
    chex.assert_tree_all_finite(jax.jacfwd(lambda x: safe_atan2(x[0], x[1]))(np.zeros(2)))


def test_elsewhere_they_are_the_plain_functions():
    x = np.array([[3.0, 4.0, 0.0], [-1.0, 2.0, 2.0]])
    np.testing.assert_array_equal(safe_norm(x), [5, 3])
    np.testing.assert_array_equal(safe_norm(x, axis=0), np.linalg.norm(x, axis=0))
    np.testing.assert_allclose(jax.grad(safe_norm)(x[1]), x[1] / 3, rtol=1e-15)
    np.testing.assert_allclose(jax.grad(safe_sqrt)(4.0), 0.25, rtol=1e-15)
    for y, z in ((1.0, 2.0), (-1.0, -2.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)):
        assert safe_atan2(y, z) == np.arctan2(y, z)
        squared = y * y + z * z
        np.testing.assert_allclose(
            jax.grad(safe_atan2, (0, 1))(y, z), (z / squared, -y / squared), atol=1e-15
        )


def test_smooth_functions_tend_to_the_sharp_ones():
    width = 1e-3
    x = np.array([3.0, -4.0, 0.0])
    assert smooth_norm(np.zeros(3), width) == 0
    np.testing.assert_allclose(smooth_norm(x, width), 5, atol=width)
    np.testing.assert_allclose(
        smooth_hinge(np.array([-1.0, 0, 2.0]), width), [0, width * np.log(2), 2], atol=1e-15
    )
    assert 3 <= smooth_max(x, width) < 3 + 1e-12
    chex.assert_tree_all_finite(
        (
            jax.grad(smooth_norm)(np.zeros(3), width),
            jax.grad(lambda v: smooth_hinge(v, width).sum())(np.array([-1e6, 0, 1e6])),
            jax.grad(smooth_max)(np.array([0.0, 0.0, 1e6]), width),
        )
    )


def test_cross_product_matrix_and_parallel_axis():
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, 4, 3))
    np.testing.assert_allclose(np.einsum("kij,kj->ki", skew(a), b), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(parallel_axis(a), -np.array(skew(a)) @ np.array(skew(a)), atol=1e-14)
