"""Sine and cosine by polynomials: against the C library's, in value and derivative, in both precisions."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.spatial.trigonometry import sine_cosine


@pytest.mark.parametrize("reach", [1e-9, 1.0, 10.0, 1e3, 1e6])
def test_values_are_the_librarys(reach):
    angle = np.concatenate([np.random.default_rng(0).uniform(-reach, reach, 20_000), [0.0, reach, -reach]])
    sine, cosine = jax.jit(sine_cosine)(angle)
    chex.assert_shape([sine, cosine], angle.shape)
    np.testing.assert_allclose(sine, np.sin(angle), rtol=0, atol=3e-16)
    np.testing.assert_allclose(cosine, np.cos(angle), rtol=0, atol=3e-16)
    np.testing.assert_allclose(sine[np.abs(angle) < 1e-8], angle[np.abs(angle) < 1e-8], rtol=1e-15)


def test_quarter_turns_meet():
    """On both sides of where the reduction changes over, and at whole quarter turns."""
    quarters = np.arange(-40, 41) * (np.pi / 4)
    angle = np.concatenate([np.nextafter(quarters, -np.inf), quarters, np.nextafter(quarters, np.inf)])
    sine, cosine = jax.jit(sine_cosine)(angle)
    np.testing.assert_allclose(sine, np.sin(angle), rtol=0, atol=3e-16)
    np.testing.assert_allclose(cosine, np.cos(angle), rtol=0, atol=3e-16)


def test_derivatives_of_both_orders():
    angle = jnp.asarray(np.random.default_rng(1).uniform(-20, 20, 100))
    for place, first in ((0, np.cos), (1, lambda x: -np.sin(x))):
        slope = jax.grad(lambda x, place=place: sine_cosine(x)[place])
        np.testing.assert_allclose(jax.vmap(slope)(angle), first(angle), rtol=0, atol=3e-16)
        second = jax.vmap(jax.grad(slope))(angle)
        np.testing.assert_allclose(second, -sine_cosine(angle)[place], rtol=0, atol=3e-16)


def test_single_precision_and_what_is_not_finite():
    angle = np.linspace(-100, 100, 1001, dtype=np.float32)
    sine, cosine = jax.jit(sine_cosine)(angle)
    assert sine.dtype == cosine.dtype == np.float32
    np.testing.assert_allclose(sine, np.sin(angle.astype(float)), rtol=0, atol=2e-7)
    np.testing.assert_allclose(cosine, np.cos(angle.astype(float)), rtol=0, atol=2e-7)
    assert np.isnan(np.asarray(sine_cosine(jnp.array([np.nan, np.inf])))).all()
