"""Choosing parents by their values, the smaller the better, whatever the values' scale, and also where some are inf.

Goldberg and Deb, "A comparative analysis of selection schemes used in genetic algorithms", Foundations of Genetic
Algorithms 1, 1991. Roulette shares are those of value's distance to the worst finite value, relative to the largest
such distance, so neither a shift nor a scale of the values matters (infinite values have no share).
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.optimizers.randoms import uniforms
from jffsr.types import Array

ROULETTE, RANK, TOURNAMENT = "roulette", "rank", "tournament"


def select(key: Array, values: Array, count: int, scheme: str, contestants: int = 2) -> Array:
    """Indices (count,) of parents, drawn with replacement from candidates of these values (P,)."""
    if scheme == TOURNAMENT:
        size = values.shape[0]
        drawn = (uniforms(key, (contestants, count)) * size).astype(int)
        winner = drawn[0]
        for challenger in drawn[1:]:
            winner = jnp.where(values[challenger] < values[winner], challenger, winner)
        return winner
    return spin(uniforms(key, (count,)), shares(values, scheme))


def shares(values: Array, scheme: str) -> Array:
    """What each candidate has of the wheel, not normalised: by value (roulette) or by rank, the worst the least."""
    count = values.shape[0]
    if scheme == RANK:
        places = jnp.zeros(count, dtype=int).at[jnp.argsort(values)].set(jnp.arange(count))
        return (count - places).astype(float)
    finite = jnp.isfinite(values)
    # An eighth, so that neither a difference of finite numbers nor its reciprocal leaves the range of numbers.
    part = jnp.where(finite, values / 8, 0.0)
    best = jnp.min(jnp.where(finite, part, jnp.inf))
    worst = jnp.max(jnp.where(finite, part, -jnp.inf))
    spread = worst - best
    apart = spread > 16 * jnp.finfo(part.dtype).tiny
    fits = jnp.where(finite, worst - part, 0.0) / jnp.where(apart, spread, 1.0)
    # With nothing to choose between them, all candidates count the same: the finite ones, or all.
    same = jnp.where(jnp.any(finite), finite, True).astype(float)
    return jnp.where(apart, fits, same)


def spin(uniform: Array, share: Array) -> Array:
    """Where on the wheel numbers uniform in (0, 1) fall."""
    edges = jnp.cumsum(share)
    return jnp.clip(jnp.searchsorted(edges, uniform * edges[-1], side="right"), 0, share.shape[0] - 1)
