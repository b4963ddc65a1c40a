"""What the same arithmetic needs beside operators to run on the host by NumPy or traced by JAX."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.types import Array


def module_for(*values: Any) -> ModuleType:
    """jax.numpy where any leaf of the values is traced, else numpy: on the host nothing needs to be compiled."""
    return jnp if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(values)) else np


def arrays_for(xp: ModuleType, tree: Any) -> Any:
    """The leaves of a pytree as arrays of the module."""
    return jax.tree.map(xp.asarray, tree)


def computed_once(xp: ModuleType, tree: Any) -> Any:
    """The same values; keeps the compiler from computing them again for each of their consumers."""
    return jax.lax.optimization_barrier(tree) if xp is jnp else tree


def held(xp: ModuleType, tree: Any) -> Any:
    """The same values as constants of differentiation."""
    return jax.lax.stop_gradient(tree) if xp is jnp else tree


def root(xp: ModuleType, square: Array) -> Array:
    """Square root of numbers >= 0 whose gradient at zero is zero."""
    positive = square > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def larger(xp: ModuleType, a: Array, b: Array | float) -> Array:
    """The larger one, elementwise.

    The derivative of `jnp.maximum` compares both with the result: a compiler that computes one of them again, rounded
    differently, finds neither, and the derivative is zero. So is that of `jnp.minimum` and of `jnp.clip`.
    """
    return xp.where(a > b, a, b)


def smaller(xp: ModuleType, a: Array, b: Array | float) -> Array:
    """The smaller one, elementwise."""
    return xp.where(a < b, a, b)


def largest(xp: ModuleType, values: Sequence[Array]) -> Array:
    """The largest of several, elementwise, of which any two may be equal."""
    # Compared again for the derivative by each, numbers computed again might come out in another order, and two of
    # them, or none, be taken for the largest.
    found, *others = computed_once(xp, list(values))
    for other in others:
        found = larger(xp, found, other)
    return found


def clipped(xp: ModuleType, x: Array, bound: Array | float) -> Array:
    """x within [-bound, bound]."""
    return larger(xp, smaller(xp, x, bound), -bound)


def smooth_step(xp: ModuleType, x: Array) -> Array:
    """0 below 0, 1 above 1, and a cubic with level ends in between."""
    x = larger(xp, smaller(xp, x, 1.0), 0.0)
    return x * x * (3 - 2 * x)
