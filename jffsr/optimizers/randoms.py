"""Uniform numbers from 32 random bits each: half of what JAX draws for a float64, and open at both ends."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.types import Array


def uniforms(key: Array, shape: tuple[int, ...]) -> Array:
    """Numbers in the open interval (0, 1): 2^32 of them in float64, 2^23 in float32, never 0 and never 1."""
    bits = jax.random.bits(key, shape, dtype=jnp.uint32)
    kind = jnp.zeros(()).dtype
    if kind == jnp.float64:
        return (bits.astype(kind) + 0.5) * 2.0**-32
    return ((bits >> 9).astype(kind) + 0.5) * 2.0**-23


def uniform_pairs(key: Array, shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Two arrays of such numbers, at the cost of one in float64: JAX makes 64 bits at a time in any case."""
    if jnp.zeros(()).dtype != jnp.float64:
        one, other = jax.random.split(key)
        return uniforms(one, shape), uniforms(other, shape)
    bits = jax.random.bits(key, shape, dtype=jnp.uint64)
    high, low = bits >> 32, bits & 0xFFFFFFFF
    return tuple((half.astype(jnp.uint32).astype(float) + 0.5) * 2.0**-32 for half in (high, low))


def distinct_others(key: Array, count: int, how_many: int) -> list[Array]:
    """For each of `count` members, indices (count,) of `how_many` others, all different from it and each other.

    Every such tuple is equally likely: each index is drawn among those left and moved past those taken.
    """
    draws = uniforms(key, (how_many, count))
    taken = [jnp.arange(count)]
    for k in range(how_many):
        left = count - 1 - k
        index = jnp.minimum((draws[k] * left).astype(int), left - 1)
        for earlier in jnp.sort(jnp.stack(taken), axis=0):
            index = index + (index >= earlier)
        taken.append(index)
    return taken[1:]
