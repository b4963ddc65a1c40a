"""Minimise any function of one candidate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.types import Array, Scalar, Vector


def minimize(
    objective: Callable[[Vector], Scalar],
    bounds: tuple[Sequence[float], Sequence[float]],
    optimizer: str = "hybrid",
    evaluations: int | None = None,
    key: Array | int = 0,
    settings: Settings | None = None,
) -> Outcome:
    """Minimise objective(x) -> scalar, written for one candidate (d,) in jax.numpy, inside bounds.

    bounds is (lower, upper), (d,) each; key a JAX key or a seed; evaluations the budget of the swarm.
    Values that are not finite count as the worst. Returns the best point, its value, the counts of
    evaluations, the history and the last population.
    """
    lower, upper = (np.array(bound, dtype=float) for bound in bounds)
    if lower.ndim != 1 or lower.shape != upper.shape or lower.size == 0:
        raise InputError(f"bounds have shapes {lower.shape} and {upper.shape}; two vectors of one length are expected")
    if not (np.all(np.isfinite(lower)) and np.all(np.isfinite(upper)) and np.all(lower <= upper)):
        raise InputError("bounds must be finite, and no lower bound above its upper bound")
    settings = settings or Settings()
    if evaluations is not None:
        settings = replace(settings, evaluations=evaluations, swarm_evaluations=evaluations)
    key = jax.random.key(key) if isinstance(key, int) else key
    return run(build_phases(optimizer, settings), FunctionProblem(lower, upper, objective), key)
