"""What a reference needs to know of the whole: its blocks and momentum, known, regressed, or by the load's
parameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.estimation.balance import Balance, Load, load_blocks
from jffsr.reactionless.estimation.least_squares import Estimator, RecursiveLeastSquares, Regression
from jffsr.types import Array, Matrix, Matrix3, Scalar, Vector3


class LoadModel(Protocol):
    """Learns the momentum equation of robot and load from balances of the robot alone."""

    def begin(self, balance: Balance) -> Any:
        """Its state before the first sample."""

    def update(self, state: Any, balance: Balance) -> Any:
        """Its state with one sample more."""

    def blocks(self, state: Any, balance: Balance) -> tuple[Matrix3, Matrix, Vector3]:
        """H_w (3, 3), H_wphi (3, n), kg m^2, and L (3,), N m s, of robot and load in B, by the estimate."""


@register_dataclass
@dataclass(frozen=True, eq=False)
class KnownLoad:
    """A load (in the tool frame) and an angular momentum (3,), N m s, in I, that are known: what others are measured
    by."""

    load: Load
    angular_momentum: Vector3

    def begin(self, balance: Balance) -> Scalar:
        """There is nothing to learn."""
        return jnp.zeros(())

    def update(self, state: Scalar, balance: Balance) -> Scalar:
        """The same."""
        return state

    def blocks(self, state: Scalar, balance: Balance) -> tuple[Matrix3, Matrix, Vector3]:
        """The true ones."""
        locked, coupling = load_blocks(balance, self.load)
        return (
            balance.locked + locked,
            balance.coupling + coupling,
            balance.rotation.T @ self.angular_momentum,
        )


@register_dataclass
@dataclass(frozen=True)
class RegressedLoad:
    """d = W' [1; w_0; qd] by an estimator of least squares, which follows W = [L, -dH_w, -dH_wphi]' as the arm moves.

    Multiples of the true momentum equation predict as well as it does, and hold the base as well.
    """

    estimator: Estimator = field(default_factory=RecursiveLeastSquares)

    def begin(self, balance: Balance) -> Regression:
        """No load and no momentum."""
        return self.estimator.init(balance.regressor.shape[0], 3)

    def update(self, state: Regression, balance: Balance) -> Regression:
        """One sample more."""
        return self.estimator.update(state, balance.regressor, balance.own_momentum, balance.usable)

    def blocks(self, state: Regression, balance: Balance) -> tuple[Matrix3, Matrix, Vector3]:
        """Those of the robot plus those regressed."""
        w: Array = state.weights.T
        return balance.locked - w[:, 1:4], balance.coupling - w[:, 4:], w[:, 0]
