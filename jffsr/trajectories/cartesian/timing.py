"""Smooth timings from rest to rest: how far along its path the tool is at a time."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.trajectories.checks import checked_duration
from jffsr.types import Array, Scalar

_RAMP = 0.2


@register_dataclass
@dataclass(frozen=True, eq=False)
class Trapezoid:
    """Trapezoidal velocity law: constant acceleration, constant rate, constant deceleration.

    duration scalar, s; ramp_fraction scalar, the share of the duration that each of the two ramps takes, above zero
    and at most 1/2. The peak rate is 1/(duration (1 - ramp_fraction)). Before and after, the tool rests at the ends.
    """

    duration: Array
    ramp_fraction: Array = field(default_factory=lambda: np.array(_RAMP))

    @classmethod
    def over(cls, duration: float, ramp_fraction: float = _RAMP) -> Trapezoid:
        """A checked law from host numbers; InputError for a duration or a share outside its range."""
        if not 0 < ramp_fraction <= 0.5:
            raise InputError(f"ramp_fraction is {ramp_fraction:g}; it must be above 0 and at most 0.5")
        return cls(checked_duration(duration), np.array(ramp_fraction, dtype=float))

    def __call__(self, time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """s, ds/dt (1/s) and d2s/dt2 (1/s^2) at a time, s."""
        share, inside = _share(time, self.duration)
        ramp, peak = self.ramp_fraction, 1 / (1 - self.ramp_fraction)
        left = 1 - share
        rising, falling = share < ramp, left < ramp
        s = jnp.where(
            rising,
            peak * share**2 / (2 * ramp),
            jnp.where(falling, 1 - peak * left**2 / (2 * ramp), peak * (share - ramp / 2)),
        )
        rate = peak * jnp.where(rising, share / ramp, jnp.where(falling, left / ramp, 1.0))
        acceleration = peak / ramp * jnp.where(rising, 1.0, jnp.where(falling, -1.0, 0.0)) * inside
        return s, rate / self.duration, acceleration / self.duration**2


@register_dataclass
@dataclass(frozen=True, eq=False)
class Quintic:
    """10 x^3 - 15 x^4 + 6 x^5 of x = t/duration: at both ends at rest and without acceleration.

    duration scalar, s. Before and after, the tool rests at the ends.
    """

    duration: Array

    @classmethod
    def over(cls, duration: float) -> Quintic:
        """A checked law from host numbers; InputError for a duration that is not positive."""
        return cls(checked_duration(duration))

    def __call__(self, time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """s, ds/dt (1/s) and d2s/dt2 (1/s^2) at a time, s."""
        x, _ = _share(time, self.duration)
        s = x**3 * (10 + x * (-15 + 6 * x))
        rate = 30 * x**2 * (x - 1) ** 2
        acceleration = 60 * x * (x - 1) * (2 * x - 1)
        return s, rate / self.duration, acceleration / self.duration**2


@register_dataclass
@dataclass(frozen=True, eq=False)
class Uniform:
    """s = t/duration at a constant rate, for a path that has its own timing.

    duration scalar, s. The rate jumps at both ends, beyond which the tool rests.
    """

    duration: Array

    def __call__(self, time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """s, ds/dt (1/s) and d2s/dt2 (1/s^2) at a time, s."""
        share, inside = _share(time, self.duration)
        return share, inside / self.duration, jnp.zeros_like(share)


def _share(time: Scalar, duration: Array) -> tuple[Scalar, Scalar]:
    """Share of the duration, held at 0 and 1 outside, and one inside, zero outside."""
    share = jnp.asarray(time) / duration
    inside = (share >= 0) & (share <= 1)
    return jnp.where(inside, share, jnp.where(share < 0, 0.0, 1.0)), inside.astype(share.dtype)
