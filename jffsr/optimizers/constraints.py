"""Constraints: how far a candidate misses them, and Deb's feasibility rules as one number to minimise.

Deb, "An efficient constraint handling method for genetic algorithms", Computer Methods in Applied Mechanics and
Engineering 186 (2000): what keeps the constraints beats what does not; of two that keep them the better value
wins, of two that do not the smaller violation. The merit has this order and full relative precision in both of
its ranges, so that an algorithm that only compares values follows the rules without knowing of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

TOLERANCE = 1e-8
"""How far off zero an equality is still kept, where nothing else is said."""


class Evaluation(NamedTuple):
    """One candidate: the smooth objective and the true one, equalities (e,), zero when kept, and inequalities
    (i,), at most zero when kept; tolerance, one or (e,), is how far off an equality counts as kept."""

    smooth: Scalar
    value: Scalar
    equality: Array
    inequality: Array
    tolerance: Array | float = TOLERANCE


class ConstrainedProblem(Protocol):
    """A box, an objective and constraints, written for one candidate (d,)."""

    def bounds(self) -> tuple[Vector, Vector]: ...

    def evaluation(self, candidate: Vector, looseness: Scalar) -> Evaluation: ...


def _scale(dtype: Any) -> tuple[float, float]:
    """The factor of a violation, and the least violation that counts as one; their product parts the ranges."""
    return (1e100, 1e-40) if jnp.finfo(dtype).bits == 64 else (1e20, 1e-10)


def violation(evaluation: Evaluation) -> Scalar:
    """Euclidean norm of what the equalities are off by beyond their tolerance and the inequalities above zero.

    Not a number where one of them is none.
    """
    off = jnp.maximum(jnp.abs(evaluation.equality) - evaluation.tolerance, 0.0)
    above = jnp.maximum(evaluation.inequality, 0.0)
    # Taken by the largest, lest squares of small numbers vanish.
    amounts = jnp.concatenate([off, above])
    largest = jnp.max(amounts, initial=0.0)
    safe = jnp.where(largest > 0, largest, 1.0)
    return largest * jnp.sqrt(jnp.maximum(jnp.sum((amounts / safe) ** 2), 1.0))


def merit(evaluation: Evaluation) -> Scalar:
    """The value where every constraint is kept, else the violation times 1e100 (1e20 in float32).

    Values must be below 1e60 (1e10): larger ones count as that. A violation below 1e-40 (1e-10) counts as
    none. NaN where the value or a constraint is not finite.
    """
    amount = violation(evaluation)
    big, least = _scale(amount.dtype)
    value = jnp.minimum(evaluation.value, 0.5 * big * least)
    found = jnp.where(amount > least, big * amount, value)
    return jnp.where(jnp.isfinite(evaluation.value) & jnp.isfinite(amount), found, jnp.nan)


def split(merits: Any, dtype: Any = np.float64) -> tuple[np.ndarray, np.ndarray]:
    """Values and violations of merits, on the host; the value of one that breaks a constraint is +inf."""
    big, least = _scale(dtype)
    merits = np.asarray(merits, dtype=float)
    broken = merits > 0.75 * big * least
    return np.where(broken, np.inf, merits), np.where(broken, merits / big, 0.0)


@register_dataclass
@dataclass(frozen=True)
class Feasible:
    """A constrained problem for any optimizer: its value is the merit.

    The stand-in for gradients is the smooth objective with a quadratic penalty of the constraints, `penalty`
    its weight; the augmented Lagrangian asks for the evaluation instead.
    """

    problem: ConstrainedProblem
    penalty: Array | float = 100.0

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds."""
        return self.problem.bounds()

    def evaluation(self, candidate: Vector, looseness: Scalar | float = 1.0) -> Evaluation:
        """That of the problem."""
        return self.problem.evaluation(candidate, looseness)

    def value(self, candidate: Vector) -> Scalar:
        """The merit."""
        return merit(self.problem.evaluation(candidate, 1.0))

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The penalised smooth objective, and the merit."""
        found = self.problem.evaluation(candidate, looseness)
        squares = jnp.sum(found.equality**2) + jnp.sum(jnp.maximum(found.inequality, 0.0) ** 2)
        return found.smooth + 0.5 * self.penalty * squares, merit(found)


@register_dataclass
@dataclass(frozen=True)
class ConstrainedFunctions:
    """Functions of one candidate with bounds (d,) each; the functions are static, None where there is none."""

    lower: Array
    upper: Array
    tolerance: Array | float
    function: Callable[[Vector], Scalar] = field(metadata={"static": True})
    equality: Callable[[Vector], Array] | None = field(default=None, metadata={"static": True})
    inequality: Callable[[Vector], Array] | None = field(default=None, metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds."""
        return self.lower, self.upper

    def evaluation(self, candidate: Vector, looseness: Scalar | float = 1.0) -> Evaluation:
        """The functions; the objective is its own stand-in."""
        value = self.function(candidate)
        none = jnp.zeros(0, candidate.dtype)
        equality = none if self.equality is None else jnp.ravel(jnp.asarray(self.equality(candidate)))
        inequality = none if self.inequality is None else jnp.ravel(jnp.asarray(self.inequality(candidate)))
        return Evaluation(value, value, equality, inequality, self.tolerance)
