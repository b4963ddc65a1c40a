"""The augmented Lagrangian: known optima and multipliers, counts, resumption, NaN."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from constrained_functions import G06, G08, G11, HS71
from scipy.optimize import minimize as scipy_minimize

from jffsr.optimizers import driver
from jffsr.optimizers.augmented import AugmentedLagrangian, constrained_phases
from jffsr.optimizers.constraints import ConstrainedFunctions, Feasible
from jffsr.optimizers.driver import Phase, Stop, run
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.interface import Population
from jffsr.optimizers.minimize import minimize
from jffsr.optimizers.registry import Settings, build_phases

KEY = jax.random.key(7)


def problem_of(case) -> Feasible:
    return Feasible(
        ConstrainedFunctions(case.lower, case.upper, 1e-8, case.function, case.equality, case.inequality)
    )


def near(case, count=2, spread=0.1) -> Population:
    """Starts about the optimum, within the box, whose values are not known."""
    away = np.random.default_rng(3).normal(size=(count, case.optimum.size)) * spread
    width = np.minimum(case.upper - case.lower, 10.0)
    points = np.clip(case.optimum + away * width, case.lower, case.upper)
    return Population(jnp.asarray(points), jnp.full(count, jnp.inf))


def descended(case, steps=400, start=None, **keywords):
    optimizer = AugmentedLagrangian(GradientDescent(starts=2), **keywords)
    phase = Phase("constrained", optimizer, Stop(iterations=float(steps)))
    seen = []
    outcome = run(
        [phase], problem_of(case), KEY, population=start or near(case), chunk=50, on_chunk=seen.append
    )
    return outcome, seen


@pytest.mark.parametrize("case", [G06, G08, G11, HS71], ids=["g06", "g08", "g11", "hs71"])
def test_published_optimum(case):
    outcome, seen = descended(case)
    x = outcome.best_position
    if case.equality is not None:
        assert np.max(np.abs(case.equality(x))) <= 1e-10
    if case.inequality is not None:
        assert np.max(case.inequality(x)) <= 0
    assert outcome.best_value == pytest.approx(case.value, rel=2e-8)
    print(outcome.gradient_evaluations, outcome.reason, outcome.best_value - case.value)
