"""Test functions with their optimum off the centre of an asymmetric box, and one that fails at random places."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

DIMENSIONS = 12
LOWER = np.linspace(-4.0, -2.5, DIMENSIONS)
UPPER = np.linspace(5.0, 6.5, DIMENSIONS)
OPTIMUM = 1.3 * np.sin(1.0 + np.arange(DIMENSIONS)) + 0.4


def sphere(x):
    return jnp.sum((x - OPTIMUM[: x.shape[0]]) ** 2)


def rastrigin(x):
    y = x - OPTIMUM[: x.shape[0]]
    return jnp.sum(y**2 - 10 * jnp.cos(2 * jnp.pi * y) + 10)


def rosenbrock(x):
    y = x - OPTIMUM[: x.shape[0]] + 1
    return jnp.sum(100 * (y[1:] - y[:-1] ** 2) ** 2 + (1 - y[:-1]) ** 2)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Poisoned:
    """The shifted sphere with NaN at `percent` of the points of the box, chosen by a hash of the position."""

    percent: jax.Array
    dimensions: int = field(default=4, metadata={"static": True})

    def bounds(self):
        return jnp.asarray(LOWER[: self.dimensions]), jnp.asarray(UPPER[: self.dimensions])

    def is_poisoned(self, x):
        bits = jax.lax.bitcast_convert_type(x, jnp.uint64)
        mixed = (bits ^ (bits >> 29)) * np.uint64(0xBF58476D1CE4E5B9)
        total = jnp.sum(mixed * (2 * jnp.arange(x.shape[0], dtype=jnp.uint64) + 1))
        total = (total ^ (total >> 32)) * np.uint64(0x94D049BB133111EB)
        return (total >> 33) % 100 < jnp.asarray(self.percent, dtype=jnp.uint64)

    def value(self, x):
        return jnp.where(self.is_poisoned(x), jnp.nan, sphere(x))

    def smooth_and_value(self, x, looseness=1.0):
        value = self.value(x)
        return value, value
