"""The quadratic program with priced rows: closed forms, and SciPy on the same program written with slacks."""

from __future__ import annotations

from functools import partial

import jax
import numpy as np
import pytest
from scipy.optimize import minimize

from jffsr.optimizers.quadratic_program import quadratic_step

solve = jax.jit(partial(quadratic_step, iterations=30))


def test_equalities_are_met_by_the_shortest_step():
    rng = np.random.default_rng(1)
    rows, offset = rng.normal(size=(2, 5)), np.array([3e-5, -2e-5])
    wide = np.ones(5)
    found = solve(np.eye(5), np.zeros(5), rows, offset, np.ones(2, bool), -wide, wide, np.full(2, 1e3))
    np.testing.assert_allclose(found.step, -np.linalg.pinv(rows) @ offset, atol=1e-10)
    np.testing.assert_allclose(rows.T @ found.multiplier, -np.asarray(found.step), atol=1e-10)


def test_the_box_cuts_what_goes_beyond_it():
    gradient, diagonal = np.array([4.0, -1.0, 0.3, -5.0, 0.2]), np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    row = np.zeros((2, 5))
    # The first number is at its bound: nothing is below zero.
    lower, upper = np.array([0.0, -1, -1, -1, -1]), np.array([0.5, 0.2, 0.5, 0.5, 0.5])
    found = solve(np.diag(diagonal), gradient, row, -np.ones(2), np.zeros(2, bool), lower, upper, np.ones(2))
    np.testing.assert_allclose(found.step, np.clip(-gradient / diagonal, lower, upper), atol=1e-9)


def test_a_row_that_cannot_be_met_has_its_price_for_multiplier():
    """x <= 0.5 by the box, x = 1 wanted by one row and -x <= -2 by the other."""
    rows, offset, price = np.array([[1.0], [-1.0]]), np.array([-1.0, 2.0]), np.array([3.0, 7.0])
    kinds, box = np.array([True, False]), np.array([0.5])
    found = solve(np.eye(1), np.zeros(1), rows, offset, kinds, -box, box, price)
    np.testing.assert_allclose(found.step, box, atol=1e-9)
    np.testing.assert_allclose(found.multiplier, [-3.0, 7.0], atol=1e-8)


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_it_is_what_scipy_finds_with_slacks(seed):
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(5, 5))
    hessian, gradient = root @ root.T + 0.1 * np.eye(5), rng.normal(size=5)
    rows, offset, price = rng.normal(size=(4, 5)), 0.4 * rng.normal(size=4), np.array([9.0, 0.2, 5.0, 0.1])
    kinds, box = np.array([True, True, False, False]), np.full(5, 0.6)
    found = solve(hessian, gradient, rows, offset, kinds, -box, box, price)

    def cost(v):
        return gradient @ v[:5] + v[:5] @ hessian @ v[:5] / 2 + price @ v[5:]

    above = np.hstack([-rows, np.eye(4)])
    below = np.hstack([rows[:2], np.eye(2), np.zeros((2, 2))])
    limits = np.vstack([above, below])
    least = np.concatenate([offset, -offset[:2]])
    reference = minimize(
        cost,
        np.concatenate([np.zeros(5), np.abs(offset)]),
        jac=lambda v: np.concatenate([gradient + hessian @ v[:5], price]),
        constraints={"type": "ineq", "fun": lambda v: limits @ v - least, "jac": lambda v: limits},
        bounds=[(-0.6, 0.6)] * 5 + [(0, None)] * 4,
        method="SLSQP",
        options={"ftol": 1e-13, "maxiter": 300},
    )
    assert reference.success
    missed = rows @ found.step + offset
    slack = np.where(kinds, np.abs(missed), np.maximum(missed, 0.0))
    ours = cost(np.concatenate([found.step, slack]))
    assert ours <= reference.fun + 1e-8
    np.testing.assert_allclose(found.step, reference.x[:5], atol=1e-4)
    assert float(found.miss) < 1e-9
