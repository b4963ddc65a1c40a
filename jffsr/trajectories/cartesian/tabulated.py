"""A timing from a table of rates: (ds/dt)^2 linear in s between the rows, which is constant acceleration.

Over a step from s_k to s_(k+1) the acceleration is a = (v_(k+1)^2 - v_k^2)/(2 (s_(k+1) - s_k)), the time taken
2 (s_(k+1) - s_k)/(v_k + v_(k+1)), and s = s_k + v_k t + a t^2/2: exact, without integration or root finding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.trajectories.checks import checked_duration
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True, eq=False)
class Tabulated:
    """The timing that has given rates at given places of the path; C1 in time and never backwards.

    places (k,), s from 0 to 1, rising; rates (k,), ds/dt, 1/s, not negative, and of two neighbours one positive.
    Before and after, the tool rests at the ends.
    """

    places: Array
    rates: Array

    @classmethod
    def over(
        cls, places: Sequence[float], rates: Sequence[float], duration: float | None = None
    ) -> Tabulated:
        """A checked table from host numbers; a duration, s, if given, scales the rates to it.

        Raises InputError for places that do not rise from 0 to 1 or rates that would never get on.
        """
        places, rates = (np.array(x, dtype=float) for x in (places, rates))
        _refuse_sizes(places, rates, "places")
        if not (places[0] == 0 and places[-1] == 1 and np.all(np.diff(places) > 0)):
            raise InputError("places of a timing must rise from 0 to 1")
        table = cls(places, rates)
        return table if duration is None else table.to_last(checked_duration(duration))

    @classmethod
    def at_times(cls, times: Sequence[float], rates: Sequence[float]) -> Tabulated:
        """A checked table of rates at rising times, s, linear between them; they are scaled so that s ends at 1."""
        times, rates = (np.array(x, dtype=float) for x in (times, rates))
        _refuse_sizes(times, rates, "times")
        if not (times[0] == 0 and np.all(np.isfinite(times)) and np.all(np.diff(times) > 0)):
            raise InputError("times of a timing must rise from 0")
        places = np.concatenate([[0], np.cumsum(np.diff(times) * (rates[1:] + rates[:-1]) / 2)])
        return cls(places / places[-1], rates / places[-1])

    @property
    def times(self) -> Array:
        """Times (k,), s, at the places."""
        steps = 2 * (self.places[1:] - self.places[:-1]) / (self.rates[1:] + self.rates[:-1])
        return jnp.concatenate([jnp.zeros(1, steps.dtype), jnp.cumsum(steps)])

    @property
    def duration(self) -> Array:
        """Duration, s."""
        return self.times[-1]

    def to_last(self, duration: Array) -> Tabulated:
        """The same, slowed or hastened to a duration, s."""
        return replace(self, rates=self.rates * (self.duration / duration))

    def __call__(self, time: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """s, ds/dt (1/s) and d2s/dt2 (1/s^2) at a time, s."""
        times, places, rates = self.times, jnp.asarray(self.places), jnp.asarray(self.rates)
        time = jnp.asarray(time)
        before, behind = time < 0, time > times[-1]
        row = jnp.clip(jnp.searchsorted(times, time, side="right") - 1, 0, places.shape[0] - 2)
        elapsed = time - times[row]
        acceleration = (rates[row + 1] ** 2 - rates[row] ** 2) / (2 * (places[row + 1] - places[row]))
        s = places[row] + elapsed * (rates[row] + acceleration * elapsed / 2)
        rate = rates[row] + acceleration * elapsed
        outside = before | behind
        return (
            jnp.where(outside, jnp.where(before, 0.0, 1.0), s),
            jnp.where(outside, 0.0, rate),
            jnp.where(outside, 0.0, acceleration),
        )


def _refuse_sizes(rows: np.ndarray, rates: np.ndarray, what: str) -> None:
    if rows.ndim != 1 or rows.shape != rates.shape or rows.size < 2:
        raise InputError(
            f"{what} and rates of a timing have the shapes {rows.shape} and {rates.shape}; two equal rows of at "
            f"least 2 numbers are expected"
        )
    if not (np.all(np.isfinite(rates)) and np.all(rates >= 0)):
        raise InputError("rates of a timing must be finite and not negative")
    still = np.flatnonzero((rates[1:] == 0) & (rates[:-1] == 0))
    if still.size:
        raise InputError(
            f"rates {still[0]} and {still[0] + 1} of a timing are both zero: it would never get on"
        )
