"""Deb's rules as one number, and swarms that follow them."""

from __future__ import annotations

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from constrained_functions import G06, G08, G11

from jffsr.errors import InputError
from jffsr.optimizers.constraints import ConstrainedFunctions, Evaluation, Feasible, merit, split, violation
from jffsr.optimizers.minimize import minimize
from jffsr.optimizers.registry import Settings


def evaluation(value, equality=(), inequality=(), tolerance=1e-3) -> Evaluation:
    value = jnp.asarray(value, float)
    return Evaluation(value, value, jnp.array(equality, float), jnp.array(inequality, float), tolerance)


def test_violation_is_the_norm_of_what_is_missed():
    assert violation(evaluation(1.0, [1e-3, -1e-3], [0.0, -5.0])) == 0.0
    found = violation(evaluation(1.0, [3.001, -4.001], [12.0, -5.0]))
    np.testing.assert_allclose(found, 13.0, rtol=1e-14)
    # Squares of these would vanish.
    np.testing.assert_allclose(violation(evaluation(1.0, (), [3e-200, 4e-200])), 5e-200, rtol=1e-14)
    assert violation(evaluation(1.0)) == 0.0


def test_merit_orders_as_debs_rules_do():
    """Against the rules themselves, compared pair by pair; ties of the one are ties of the other."""
    rng = np.random.default_rng(5)
    values = np.concatenate([rng.normal(size=8), 10.0 ** rng.uniform(-12, 12, 8), [0.0, -1e30, 1e30]])
    missed = np.concatenate([np.zeros(8), 10.0 ** rng.uniform(-25, 25, 8), [1e-30, 3.0, 3.0 + 1e-15]])
    pairs = [(v, a) for v, a in zip(values, rng.permutation(missed), strict=True)]
    pairs += [(v, 3.0) for v in values[:3]]
    merits = [float(merit(evaluation(v, (), [a]))) for v, a in pairs]
    for (i, one), (j, other) in product(enumerate(pairs), repeat=2):
        lexicographic = [(a, 0.0) if a > 0 else (0.0, v) for v, a in (one, other)]
        assert (merits[i] < merits[j]) == (lexicographic[0] < lexicographic[1])
    found, amounts = split(merits)
    for (v, a), value, amount in zip(pairs, found, amounts, strict=True):
        assert value == (v if a == 0 else np.inf)
        np.testing.assert_allclose(amount, a, rtol=1e-14)


def test_merit_in_float32_keeps_the_order():
    cast = lambda v, a: float(  # noqa: E731
        merit(Evaluation(*(jnp.float32(x) for x in (v, v)), jnp.zeros(0, "float32"), jnp.float32([a])))
    )
    assert -1e5 == cast(-1e5, -1.0) < cast(1e5, 0.0) < cast(-1e5, 1e-6) < cast(0.0, 2e-6) < cast(0.0, 1e3)
    assert split(cast(7.0, 0.5), np.float32)[1] == pytest.approx(0.5, rel=1e-6)
    assert split(cast(7.0, -0.5), np.float32) == (7.0, 0.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_has_no_merit(bad):
    for found in (
        evaluation(bad, [0.0], [-1.0]),
        evaluation(bad, [1.0], [-1.0]),
        evaluation(1.0, [bad], [-1.0]),
    ):
        assert not np.isfinite(merit(found))
    assert np.isnan(merit(evaluation(1.0, [0.0], [np.nan])))
    assert split(np.inf) == (np.inf, np.inf)


def test_stand_in_is_the_penalised_objective():
    problem = Feasible(ConstrainedFunctions(*np.ones((2, 2)), 1e-8, G11.function, G11.equality), 50.0)
    x = jnp.array([0.3, -0.2])
    smooth, value = problem.smooth_and_value(x)
    missed = -0.2 - 0.09
    np.testing.assert_allclose(smooth, G11.function(x) + 25 * missed**2, rtol=1e-14)
    assert value == problem.value(x) == pytest.approx(1e100 * (abs(missed) - 1e-8), rel=1e-12)


@pytest.mark.parametrize("case", [G06, G08], ids=["g06", "g08"])
def test_swarm_finds_the_published_optimum(case):
    found = minimize(
        case.function, (case.lower, case.upper), "qpso", 15_000, key=1, inequality=case.inequality
    )
    assert found.violation == 0
    assert np.all(np.asarray(case.inequality(found.best_position)) <= 0)
    assert found.best_value == pytest.approx(case.value, rel=5e-3)
    assert found.best_value >= case.value - 1e-9 * abs(case.value)


def test_swarm_keeps_an_equality_within_its_tolerance():
    """To the optimum along the line of the equality a swarm has far to go; on it, it is soon."""
    bounds = (G11.lower, G11.upper)
    found = minimize(G11.function, bounds, "qpso", 5000, equality=G11.equality, tolerance=1e-3)
    assert found.violation == 0
    assert abs(G11.equality(found.best_position)[0]) <= 1e-3
    assert G11.value - 2e-3 <= found.best_value <= 1.0


def test_what_cannot_be_kept_is_missed_least():
    """x <= -1 and x >= 2 at once: the sum of squares is least halfway."""
    found = minimize(
        lambda x: x[0],
        ([-5.0], [5.0]),
        "qpso",
        4000,
        inequality=lambda x: jnp.array([x[0] + 1, 2 - x[0]]),
    )
    np.testing.assert_allclose(found.best_position, 0.5, atol=1e-6)
    assert found.violation == pytest.approx(np.hypot(1.5, 1.5), rel=1e-9)
    assert found.best_value == pytest.approx(0.5, abs=1e-6)


def test_a_share_of_nan_in_the_constraints_does_no_harm():
    found = minimize(
        lambda x: jnp.sum((x - 1) ** 2),
        (np.full(3, -4.0), np.full(3, 5.0)),
        "qpso",
        settings=Settings(particles=20, evaluations=4000),
        inequality=lambda x: jnp.where(jnp.sin(40 * x[0]) > 0.3, jnp.nan, 1.5 - x[1])[None],
    )
    assert found.violation == 0
    assert found.best_position[1] >= 1.5
    assert found.best_value == pytest.approx(0.25, abs=0.02)


def test_nothing_finite_ends_as_infinite():
    nothing = minimize(
        lambda x: jnp.nan * x[0],
        ([-5.0], [5.0]),
        "qpso",
        100,
        inequality=lambda x: x,
    )
    assert nothing.best_value == nothing.violation == np.inf


def test_a_tolerance_that_is_none_is_refused():
    for tolerance in (0.0, -1.0, np.nan):
        with pytest.raises(InputError, match="a positive number is expected"):
            minimize(G11.function, (G11.lower, G11.upper), equality=G11.equality, tolerance=tolerance)
    assert jax.config.jax_enable_x64
