"""What an optimizer is, and what it optimizes.

An optimizer is a frozen dataclass registered as a pytree, its hyperparameters traced, its sizes static, with
`init(key, problem, population) -> state` and `step(problem, state) -> state`. Everything that changes is in
the state, which is therefore the checkpoint. One driver runs them all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector


class OptimizationProblem(Protocol):
    """A box and an objective, written for one candidate (d,).

    `value` is what is minimised and reported. `smooth_and_value` gives a differentiable stand-in for it
    together with the value itself; a looseness above 1 makes the stand-in rounder and easier.
    """

    def bounds(self) -> tuple[Vector, Vector]: ...

    def value(self, candidate: Vector) -> Scalar: ...

    def smooth_and_value(self, candidate: Vector, looseness: Scalar) -> tuple[Scalar, Scalar]: ...


@register_dataclass
@dataclass(frozen=True)
class FunctionProblem:
    """Any function of one candidate, with bounds (d,) each; the function is static."""

    lower: Array
    upper: Array
    function: Callable[[Vector], Scalar] = field(metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds."""
        return self.lower, self.upper

    def value(self, candidate: Vector) -> Scalar:
        """The function."""
        return self.function(candidate)

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The function twice: it is its own stand-in."""
        value = self.function(candidate)
        return value, value


@register_dataclass
@dataclass(frozen=True)
class Progress:
    """What every optimizer's state carries for the driver.

    best_position (d,) and best_value (), the best finite point so far; iteration (); evaluations () of the
    objective and gradient_evaluations () counted apart; converged (), whether more steps would be idle.
    """

    best_position: Array
    best_value: Array
    iteration: Array
    evaluations: Array
    gradient_evaluations: Array
    converged: Array


def no_progress(position: Vector) -> Progress:
    """Progress before the first evaluation; `position` only gives the best point a shape and a place."""
    zero = jnp.zeros((), dtype=int)
    return Progress(position, jnp.array(jnp.inf), zero, zero, zero, jnp.array(False))


class Population(NamedTuple):
    """Candidates (k, d) and their values (k,), handed from one optimizer to the next."""

    positions: Array
    values: Array


class Optimizer(Protocol):
    """See the module's text; `population` gives the candidates that the next phase may start from."""

    def init(self, key: Array, problem: OptimizationProblem, population: Population | None): ...

    def step(self, problem: OptimizationProblem, state): ...

    def population(self, state) -> Population: ...


def finite_or_inf(values: Array) -> Array:
    """Values with everything that is not finite made +inf: argmin would return the index of a NaN."""
    return jnp.where(jnp.isfinite(values), values, jnp.inf)


def better_of(position: Vector, value: Scalar, positions: Array, values: Array) -> tuple[Vector, Scalar]:
    """The best of one point and a batch (k, d), (k,); a tie keeps the one point."""
    index = jnp.argmin(values)
    wins = values[index] < value
    return jnp.where(wins, positions[index], position), jnp.where(wins, values[index], value)


def after_trials(
    progress: Progress, positions: Array, values: Array, tried: Array, active: Array
) -> Progress:
    """The progress after one more trial of the starts `tried` (k,), whose best points (k, d) and values (k,) these are.

    Each trial cost a gradient; all has converged where no start is `active` (k,) any more.
    """
    best_position, best_value = better_of(
        progress.best_position, progress.best_value, positions, finite_or_inf(values)
    )
    return replace(
        progress,
        best_position=best_position,
        best_value=best_value,
        iteration=progress.iteration + 1,
        gradient_evaluations=progress.gradient_evaluations + jnp.sum(tried),
        converged=~jnp.any(active),
    )


def sample_box(key: Array, problem: OptimizationProblem, count: int) -> Array:
    """Candidates (count, d) uniform in the box."""
    lower, upper = (jnp.asarray(bound, dtype=float) for bound in problem.bounds())
    return jax.random.uniform(key, (count, lower.shape[0]), minval=lower, maxval=upper)


def box_of(bounds: tuple[Sequence[float], Sequence[float]]) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds (d,) as host arrays; InputError where they are no box."""
    lower, upper = (np.array(bound, dtype=float) for bound in bounds)
    if lower.ndim != 1 or lower.shape != upper.shape or lower.size == 0:
        raise InputError(
            f"bounds have shapes {lower.shape} and {upper.shape}; two vectors of one length are expected"
        )
    if not (np.all(np.isfinite(lower)) and np.all(np.isfinite(upper)) and np.all(lower <= upper)):
        raise InputError("bounds must be finite, and no lower bound above its upper bound")
    return lower, upper
