"""A smooth map between a box and all of R^n, so that unconstrained methods stay inside bounds."""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.types import Vector

# The map is flat at a bound: a start on it would never leave, so it is pulled in by this share of the box.
_INSET = 1e-3


def to_box(free: Vector, lower: Vector, upper: Vector) -> Vector:
    """The point of the box, middle + half width times sin(free); a width of zero gives the bound."""
    return (upper + lower) / 2 + (upper - lower) / 2 * jnp.sin(free)


def from_box(point: Vector, lower: Vector, upper: Vector) -> Vector:
    """The unconstrained coordinates of a point, pulled slightly off the bounds."""
    half = (upper - lower) / 2
    wide = half > 0
    share = jnp.where(wide, (point - (upper + lower) / 2) / jnp.where(wide, half, 1.0), 0.0)
    return jnp.arcsin(jnp.clip(share, -1 + _INSET, 1 - _INSET))
