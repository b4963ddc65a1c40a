"""Recursive least squares with forgetting, and over a sliding window: W of value = W' regressor.

N = Q phi/(lambda r + phi' Q phi), Q <- (1 - N phi') Q/lambda, W <- W + N (y - W' phi)' (Ye, Dong and Hong 2019, as
corrected), with r the variance of the noise: forgetting Q <- Q/lambda, then the sample. Where nothing excites a
direction, that lets Q grow without bound. Here as much information is put back, in every direction alike, as keeps Q
within a bound (after Salgado, Goodwin and Middleton 1988); to scale Q down as a whole instead would let the
directions that nothing excites drown the others. Or only what the regressor brings anew is forgotten (Cao and
Schwartz 2000).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import jax
import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.estimation.forgetting import ConstantForgetting, Forgetting
from jffsr.types import Array, Matrix, Scalar, Vector

INITIAL = 1.4
"""Ye, Dong and Hong 2019: Q(0) = 1.4 E."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class Regression:
    """What an estimator knows: weights (p, r); covariance (p, p), per unit of the noise's variance once scaled by it;
    innovation (r,) of the last sample used; count (), of them; memory, what else the estimator keeps."""

    weights: Matrix
    covariance: Matrix
    innovation: Vector
    count: Scalar
    memory: Any = None


class Estimator(Protocol):
    """A pair of pure functions; what is lost or not finite changes nothing."""

    def init(self, size: int, values: int) -> Regression:
        """Knowing nothing of a regressor of a size and so many values."""

    def update(self, known: Regression, regressor: Vector, value: Vector, fresh: Scalar) -> Regression:
        """Knowing one sample more: regressor (p,), value (r,); fresh (), bool, is false where it was lost."""


@register_dataclass
@dataclass(frozen=True)
class RecursiveLeastSquares:
    """Recursive least squares with a law of forgetting.

    initial: Q(0) is that times the unit matrix; variance, r, of the values' noise. largest: no eigenvalue of Q
    exceeds that multiple of Q(0)'s, so that its trace is bounded; infinite leaves Q to itself, as published.
    directional, static: only the direction of the regressor is forgotten.
    """

    forgetting: Forgetting = field(default_factory=ConstantForgetting)
    initial: Array | float = INITIAL
    variance: Array | float = 1.0
    largest: Array | float = 1.0
    directional: bool = field(default=False, metadata={"static": True})

    def init(self, size: int, values: int) -> Regression:
        """Weights of zero with the covariance Q(0)."""
        return _ignorant(size, values, self.initial)

    def update(self, known: Regression, regressor: Vector, value: Vector, fresh: Scalar) -> Regression:
        """One sample more."""
        regressor, value, usable = _usable(regressor, value, fresh)
        q, r = known.covariance, self.variance
        innovation = value - known.weights.T @ regressor
        factor = self.forgetting(known.count, innovation, regressor @ q @ regressor / r)
        q = self._forgotten(q, regressor, factor)
        seen = q @ regressor
        gain = seen / (r + regressor @ seen)
        q = q - jnp.outer(gain, seen)
        found = Regression(
            known.weights + jnp.outer(gain, innovation), 0.5 * (q + q.T), innovation, known.count + 1
        )
        return _if_usable(usable, found, known)

    def _forgotten(self, q: Matrix, regressor: Vector, factor: Scalar) -> Matrix:
        """Q (p, p) after forgetting, within its bound."""
        if self.directional:
            # Information along phi shrinks to its share lambda, and no other.
            worth = regressor @ jax.scipy.linalg.solve(q, regressor, assume_a="pos")
            return q + (1 / factor - 1) * jnp.outer(regressor, regressor) / jnp.maximum(worth, 1e-300)
        # Q^-1 <- lambda Q^-1 + (1 - lambda)/most, written so that it holds for any bound.
        share = (1 - factor) / (self.largest * self.initial)
        return jnp.linalg.solve(factor * jnp.eye(q.shape[0]) + share * q, q)


@register_dataclass
@dataclass(frozen=True)
class SlidingWindow:
    """Least squares over the last `length` (static) samples, drawn to the last estimate with the weight of Q(0).

    What the window does not excite keeps its value, and the covariance never exceeds Q(0).
    """

    length: int = field(default=100, metadata={"static": True})
    initial: Array | float = INITIAL
    variance: Array | float = 1.0

    def init(self, size: int, values: int) -> Regression:
        """An empty window."""
        rows = jnp.zeros((self.length, size)), jnp.zeros((self.length, values))
        known = _ignorant(size, values, self.initial)
        return Regression(known.weights, known.covariance, known.innovation, known.count, rows)

    def update(self, known: Regression, regressor: Vector, value: Vector, fresh: Scalar) -> Regression:
        """One sample more, and the oldest less."""
        regressor, value, usable = _usable(regressor, value, fresh)
        rows, values = known.memory
        place = jnp.mod(known.count, self.length)
        rows, values = rows.at[place].set(regressor), values.at[place].set(value)
        eye = jnp.eye(regressor.shape[0])
        factor = jax.scipy.linalg.cho_factor(rows.T @ rows / self.variance + eye / self.initial)
        wrong = rows.T @ (values - rows @ known.weights) / self.variance
        weights = known.weights + jax.scipy.linalg.cho_solve(factor, wrong)
        innovation = value - known.weights.T @ regressor
        covariance = jax.scipy.linalg.cho_solve(factor, eye)
        found = Regression(weights, covariance, innovation, known.count + 1, (rows, values))
        return _if_usable(usable, found, known)


def _ignorant(size: int, values: int, initial: Array | float) -> Regression:
    return Regression(
        jnp.zeros((size, values)),
        initial * jnp.eye(size),
        jnp.zeros(values),
        jnp.zeros((), dtype=jnp.int32),
    )


def _usable(regressor: Vector, value: Vector, fresh: Scalar) -> tuple[Vector, Vector, Scalar]:
    """The sample with numbers in place of what is not finite, and whether it may be used."""
    usable = jnp.asarray(fresh) & jnp.all(jnp.isfinite(regressor)) & jnp.all(jnp.isfinite(value))
    return jnp.where(usable, regressor, 0.0), jnp.where(usable, value, 0.0), usable


def _if_usable(usable: Scalar, found: Regression, known: Regression) -> Regression:
    return jax.tree.map(lambda new, old: jnp.where(usable, new, old), found, known)
