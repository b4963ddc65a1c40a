"""How much of the past least squares keep: a factor lambda in (0, 1] per sample, 1 for all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector


class Forgetting(Protocol):
    """Factor (), of the samples used so far, (), the innovation (r,) and phi' Q phi over the noise's variance, ()."""

    def __call__(self, count: Scalar, innovation: Vector, leverage: Scalar) -> Scalar: ...


@register_dataclass
@dataclass(frozen=True)
class ConstantForgetting:
    """The same factor always; 1 is plain least squares."""

    factor: Array | float = 1.0

    def __call__(self, count: Scalar, innovation: Vector, leverage: Scalar) -> Scalar:
        """The factor ()."""
        return jnp.asarray(self.factor, dtype=float)


@register_dataclass
@dataclass(frozen=True)
class ClockForgetting:
    """Ye, Dong and Hong 2019: largest - share exp(-rate k) at sample k, a clock that no later change resets."""

    largest: Array | float = 0.99
    share: Array | float = 0.1
    rate: Array | float = 0.04

    def __call__(self, count: Scalar, innovation: Vector, leverage: Scalar) -> Scalar:
        """The factor ()."""
        return self.largest - self.share * jnp.exp(-self.rate * count)


@register_dataclass
@dataclass(frozen=True)
class InnovationForgetting:
    """Fortescue, Kershenbaum and Ydstie 1981: as much is forgotten as keeps the information's worth constant.

    lambda = 1 - |innovation|^2/((1 + leverage) r variance memory), never below `least`: variance, (N m s)^2, is what an
    innovation of r components is expected to have in each, and memory the samples that are kept where it has just that.
    """

    variance: Array | float = 1e-5
    memory: Array | float = 500.0
    least: Array | float = 0.8

    def __call__(self, count: Scalar, innovation: Vector, leverage: Scalar) -> Scalar:
        """The factor ()."""
        squared = innovation @ innovation / innovation.shape[0]
        forgotten = squared / ((1 + leverage) * self.variance * self.memory)
        return jnp.clip(1 - forgotten, self.least, 1.0)
