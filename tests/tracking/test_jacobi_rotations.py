"""Many small decompositions at once against LAPACK's one by one, where singular values are equal, zero or far apart."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.tracking.damping import constant, raised_cosine
from jffsr.tracking.inverses import filtered_inverse, inverse_and_values, singular_values
from jffsr.tracking.jacobi_rotations import FEWEST, in_descending_order, orthogonalized, singular_bases

SPECTRA = [
    [2.0, 1.5, 0.7, 0.4, 0.05, 0.01],
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
    [1.0, 1.0, 0.05, 0.05, 0.05, 0.02],
    [1.0, 1.0 - 1e-9, 0.05, 0.05 + 1e-12, 0.03, 0.03 + 1e-7],
    [1.0, 0.7, 0.04, 0.0, 0.0, 0.0],
    [1e3, 1.0, 1e-3, 1e-6, 1e-9, 1e-12],
    [0.0] * 6,
]
SHAPES = {
    "square": (6, 6),
    "wide": (6, 8),
    "tall": (7, 6),
    "odd": (5, 6),
    "three rows": (3, 6),
    "one": (1, 6),
}


def batch(shape, spectra=SPECTRA):
    rng, found = np.random.default_rng(0), []
    for sigma in spectra:
        left, right = (np.linalg.qr(rng.normal(size=(k, k)))[0] for k in shape)
        middle = np.zeros(shape)
        np.fill_diagonal(middle, sigma[: min(shape)])
        found.append(left @ middle @ right.T)
    return np.stack(found)


@pytest.mark.parametrize(
    "shape",
    [
        pytest.param(shape, id=name, marks=[] if name in ("square", "wide", "one") else [pytest.mark.slow])
        for name, shape in SHAPES.items()
    ],
)
def test_bases_are_orthogonal_and_give_the_matrices(shape):
    matrices = batch(shape)
    u, sigma, v = (np.asarray(x) for x in jax.jit(jax.vmap(singular_bases))(matrices))
    scale = np.max(sigma, axis=1)[:, None]
    np.testing.assert_allclose(np.einsum("bik,bk,bjk->bij", u, sigma, v), matrices, atol=4e-15 * scale.max())
    expected = np.linalg.svd(matrices, compute_uv=False)
    ordered = np.sort(sigma, axis=1)[:, ::-1]
    assert np.all(np.abs(ordered - expected) <= 5e-15 * scale)
    shorter, longer = (u, v) if shape[0] < shape[1] else (v, u)
    eye = np.eye(min(shape))
    np.testing.assert_allclose(
        np.swapaxes(shorter, 1, 2) @ shorter, np.broadcast_to(eye, (len(matrices), *eye.shape)), atol=1e-14
    )
    # The longer side's basis is orthogonal where the values are not rounding.
    there = sigma > 1e-11 * np.maximum(scale, 1e-300)
    gram = np.swapaxes(longer, 1, 2) @ longer
    wanted = there[:, :, None] & there[:, None, :]
    np.testing.assert_allclose(np.where(wanted, gram - eye, 0.0), 0.0, atol=1e-13)


def test_it_is_the_rotations_that_are_tested(monkeypatch):
    """A batch goes by rotations, and a small one by LAPACK, which leaves nothing of a loop in the program."""

    def program(count):
        return str(jax.make_jaxpr(jax.vmap(singular_bases))(np.ones((count, 6, 6))))

    assert "while" in program(FEWEST)
    assert "svd" not in program(FEWEST)
    assert "while" not in program(FEWEST - 1)


def test_small_values_keep_their_digits():
    """Columns of very different lengths: LAPACK loses the small ones' digits to the largest, rotations do not."""
    rng = np.random.default_rng(1)
    basis = np.linalg.qr(rng.normal(size=(8, 6, 6)))[0]
    sizes = np.array([1e8, 1e4, 1.0, 1e-4, 1e-8, 1e-12])
    _, sigma, _ = jax.jit(jax.vmap(singular_bases))(basis * sizes)
    np.testing.assert_allclose(
        np.sort(np.asarray(sigma), axis=1)[:, ::-1], np.tile(sizes, (8, 1)), rtol=1e-14
    )


def test_rotations_end_soon_and_a_matrix_that_is_not_finite_spoils_no_other(monkeypatch):
    matrices = np.moveaxis(np.random.default_rng(2).normal(size=(200, 6, 6)), 0, -1)
    with monkeypatch.context() as patched:
        patched.setattr("jffsr.tracking.jacobi_rotations.MOST_SWEEPS", 7)
        seven, _ = orthogonalized(jnp.asarray(matrices))
    whole, _ = orthogonalized(jnp.asarray(matrices))
    np.testing.assert_array_equal(seven, whole)
    broken = matrices.copy()
    broken[2, 3, 17] = np.nan
    found, _ = orthogonalized(jnp.asarray(broken))
    assert np.all(np.isnan(found[..., 17]).any(axis=(0, 1)))
    others = np.arange(200) != 17
    np.testing.assert_array_equal(np.asarray(found)[..., others], np.asarray(whole)[..., others])


DAMPINGS = {"adaptive": raised_cosine(0.0571, 0.0677), "fixed": constant(0.05), "none": constant(0.0)}


@pytest.mark.parametrize(("kind", "shape"), [("adaptive", (6, 6)), ("fixed", (6, 8)), ("none", (5, 6))])
def test_inverses_of_a_batch_are_those_of_each(kind, shape):
    damping, matrices = DAMPINGS[kind], batch(shape, SPECTRA[:5])
    inverses, sigma = jax.jit(jax.vmap(lambda j: inverse_and_values(j, damping)))(matrices)
    each = jax.jit(lambda j: (filtered_inverse(j, damping), singular_values(j)))
    for k, matrix in enumerate(matrices):
        inverse, values = each(matrix)
        np.testing.assert_allclose(inverses[k], inverse, atol=2e-13 * np.abs(inverse).max() ** 2)
        np.testing.assert_allclose(sigma[k], values, atol=1e-14)


def test_derivatives_of_a_batch_are_those_of_each():
    """Also at repeated values, and by the numbers of the damping, through two nested batches."""
    matrices = np.stack([batch((6, 6), SPECTRA[:4]), batch((6, 6), SPECTRA[:4])[::-1]])
    weight = np.random.default_rng(3).normal(size=(6, 6))

    def total(matrix, numbers):
        inverse, sigma = inverse_and_values(matrix, raised_cosine(numbers[0], numbers[1]))
        return jnp.sum(weight * inverse) + sigma @ jnp.arange(6.0)

    numbers = jnp.array([0.0571, 0.0677])
    by_matrix = jax.grad(total, argnums=(0, 1))
    many = jax.jit(jax.vmap(jax.vmap(by_matrix, (0, None)), (0, None)))(matrices, numbers)
    one = jax.jit(by_matrix)
    for i, k in np.ndindex(2, 4):
        for found, expected in zip(many, one(matrices[i, k], numbers), strict=True):
            assert np.all(np.isfinite(expected))
            size = np.abs(expected).max()
            np.testing.assert_allclose(found[i, k], expected, rtol=1e-9, atol=1e-9 * size)
    # And the values, whose programs are not those of the derivatives.
    values = jax.jit(jax.vmap(jax.vmap(total, (0, None)), (0, None)))(matrices, numbers)
    expected = [[total(matrices[i, k], numbers) for k in range(4)] for i in range(2)]
    np.testing.assert_allclose(values, expected, rtol=1e-11)


def test_singular_values_in_single_precision():
    matrices = batch((6, 6), SPECTRA[:4]).astype(np.float32)
    sigma = jax.jit(jax.vmap(singular_values))(matrices)
    assert sigma.dtype == np.float32
    np.testing.assert_allclose(sigma, np.linalg.svd(matrices, compute_uv=False), atol=2e-6)


def test_order():
    values = np.random.default_rng(4).normal(size=(50, 7))
    np.testing.assert_array_equal(jax.vmap(in_descending_order)(values), np.sort(values, axis=1)[:, ::-1])
