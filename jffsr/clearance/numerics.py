"""What the same arithmetic needs beside operators to run on the host by NumPy or traced by JAX."""

from __future__ import annotations

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


def held(xp: ModuleType, value: Array) -> Array:
    """The same value as a constant of differentiation."""
    return jax.lax.stop_gradient(value) if xp is jnp else value


def root(xp: ModuleType, square: Array) -> Array:
    """Square root of numbers >= 0 whose gradient at zero is zero."""
    positive = square > 0
    return xp.where(positive, xp.sqrt(xp.where(positive, square, 1.0)), 0.0)


def clipped(xp: ModuleType, x: Array, bound: Array | float) -> Array:
    """x within [-bound, bound]."""
    return xp.maximum(xp.minimum(x, bound), -bound)


def smooth_step(xp: ModuleType, x: Array) -> Array:
    """0 below 0, 1 above 1, and a cubic with level ends in between."""
    x = xp.maximum(xp.minimum(x, 1.0), 0.0)
    return x * x * (3 - 2 * x)
