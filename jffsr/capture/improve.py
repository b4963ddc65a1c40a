"""Captures made better: the index of each problem made less under its constraints, all of them side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.optimizers.constraints import split
from jffsr.optimizers.interface import Population
from jffsr.optimizers.sequential_quadratic import SequentialQuadratic, SequentialState
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.planning.problem import Problem
from jffsr.robots.stacking import first_unlike, stacked
from jffsr.types import Array

_STEPS = 10
"""Between two looks at who is through."""

_AT_ONCE = 2
"""Evaluated together on a core, as in the restoration."""


@dataclass(frozen=True)
class Improved:
    """Of each problem the best point found: free (K, k) numbers; value (K,) of the index, infinite where some
    constraint is not kept; jacobians (K,), derivatives of index and constraints that were spent."""

    free: np.ndarray
    value: np.ndarray
    jacobians: np.ndarray

    @property
    def kept(self) -> np.ndarray:
        """Whether every constraint is kept, (K,)."""
        return np.isfinite(self.value)


@program()
def _begin(problems: Problem, points: Array, methods: SequentialQuadratic) -> SequentialState:
    def one(item):
        problem, point, method = item
        return method.init(jax.random.key(0), problem, Population(point[None], np.full(1, np.inf)))

    return spread(one, (problems, points, methods), chunk=len(points), together=True)


@program()
def _go_on(problems: Problem, states: SequentialState, methods: SequentialQuadratic) -> SequentialState:
    def one(item):
        problem, state, method = item

        def step(state, _):
            following = method.step(problem, state)
            ended = state.progress.converged
            return jax.tree.map(lambda old, new: jnp.where(ended, old, new), state, following), None

        return jax.lax.scan(step, state, length=_STEPS)[0]

    return spread(one, (problems, states, methods), chunk=_AT_ONCE, together=True)


def improve_many(
    problems: Sequence[Problem],
    free: np.ndarray,
    method: SequentialQuadratic | Sequence[SequentialQuadratic] | None = None,
) -> Improved:
    """Free numbers that make each problem's index less and keep its constraints, from free (K, k), one point each.

    Problems of one structure share one compiled program and run side by side until the last is through. Where a point
    keeps its constraints, what is found is never worse. method: one for all, or one each, of which the numbers count
    and `starts` does not. Raises InputError for problems or points that do not go
    together.
    """
    problems, free = list(problems), np.asarray(free, dtype=float)
    if not problems:
        raise InputError("no problem was given")
    other = first_unlike(problems)
    if other is not None:
        raise InputError(f"problem {other} differs from problem 0 in more than numbers; improve it apart")
    size = np.size(problems[0].bounds()[0])
    if free.shape != (len(problems), size):
        raise InputError(f"free has the shape {free.shape}; ({len(problems)}, {size}) is expected")
    method = method or SequentialQuadratic()
    methods = [method] * len(problems) if isinstance(method, SequentialQuadratic) else list(method)
    if len(methods) != len(problems):
        raise InputError(
            f"{len(methods)} methods were given for {len(problems)} problems; one each is expected"
        )
    each = stacked([jax.tree.map(lambda x: np.asarray(x, float), replace(m, starts=1)) for m in methods])
    every = stacked(problems)
    with all_devices():
        states = _begin(every, free, each)
        while True:
            states = _go_on(every, states, each)
            progress = jax.device_get(states.progress)
            if np.all(progress.converged):
                break
    value, _ = split(progress.best_value)
    return Improved(progress.best_position, value, progress.gradient_evaluations)
