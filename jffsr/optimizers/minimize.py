"""Minimise any function of one candidate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.augmented import constrained_phases
from jffsr.optimizers.constraints import TOLERANCE, ConstrainedFunctions, Feasible, split
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.interface import FunctionProblem, box_of
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.types import Array, Scalar, Vector


def minimize(
    objective: Callable[[Vector], Scalar],
    bounds: tuple[Sequence[float], Sequence[float]],
    optimizer: str = "hybrid",
    evaluations: int | None = None,
    key: Array | int = 0,
    settings: Settings | None = None,
    *,
    equality: Callable[[Vector], Array] | None = None,
    inequality: Callable[[Vector], Array] | None = None,
    tolerance: float = TOLERANCE,
) -> Outcome:
    """Minimise objective(x) -> scalar, written for one candidate (d,) in jax.numpy, inside bounds.

    bounds is (lower, upper), (d,) each; key a JAX key or a seed; evaluations the budget of the swarm.
    Values that are not finite count as the worst. Returns the best point, its value, the counts of
    evaluations, the history and the last population.

    equality(x) -> (e,) is to be zero, up to `tolerance`, and inequality(x) -> (i,) at most zero: swarms then follow
    Deb's feasibility rules, and gradients an augmented Lagrangian. `violation` of the outcome is zero where the
    best point keeps all of them; its history and population hold merits (`jffsr.optimizers.constraints.split`).
    """
    lower, upper = box_of(bounds)
    settings = settings or Settings()
    if evaluations is not None:
        settings = replace(settings, evaluations=evaluations, swarm_evaluations=evaluations)
    key = jax.random.key(key) if isinstance(key, int) else key
    phases = build_phases(optimizer, settings)
    if equality is None and inequality is None:
        return run(phases, FunctionProblem(lower, upper, objective), key)
    if not (np.isfinite(tolerance) and tolerance > 0):
        raise InputError(f"tolerance is {tolerance:g}; a positive number is expected")
    problem = ConstrainedFunctions(lower, upper, tolerance, objective, equality, inequality)
    outcome = run(constrained_phases(phases), Feasible(problem), key)
    _, amount = split(outcome.best_value, outcome.best_position.dtype)
    value = float(objective(outcome.best_position)) if np.isfinite(outcome.best_value) else np.inf
    return replace(outcome, best_value=value, violation=float(amount))
