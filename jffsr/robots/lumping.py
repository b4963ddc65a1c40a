"""Rigid parts joined into one body, in NumPy for data of the host and in JAX for whatever is traced."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.spatial.components import quaternion_rows
from jffsr.types import Array, Matrix3, Quaternion, Scalar, Vector3

Part = tuple[Scalar, Vector3, Matrix3]
"""Mass, centre of mass, inertia about it; all parts of a body in the axes and from the origin of one frame."""


def array_module(*values: Any) -> ModuleType:
    """jax.numpy where any leaf of the values is a JAX array, traced ones among them; else numpy.

    NumPy keeps data of the host in float64 also where JAX would make float32 of them.
    """
    return jnp if any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(values)) else np


def to_array(value: Any) -> Array:
    """The value as an array: of JAX where a part of it is JAX's, else a NumPy array in float64."""
    xp = array_module(value)
    return jnp.asarray(value) if xp is jnp else np.asarray(value, dtype=np.float64)


def on_host(*values: Array) -> tuple[np.ndarray, ...] | None:
    """The values as NumPy arrays in float64, or None where one of them is traced and has no number."""
    if any(isinstance(value, jax.core.Tracer) for value in values):
        return None
    return tuple(np.asarray(value, dtype=np.float64) for value in values)


def lump(parts: Sequence[Part]) -> Part:
    """The parts as one rigid body: total mass, common centre of mass, inertia by the parallel-axis theorem."""
    if len(parts) == 1:
        return parts[0]
    mass = sum(part[0] for part in parts)
    com = sum(part[0] * part[1] for part in parts) / mass
    inertia = np.zeros((3, 3))
    for part_mass, part_com, part_inertia in parts:
        d = part_com - com
        about_com = d @ d * np.eye(3) - d[:, None] * d[None, :]
        inertia = inertia + (part_inertia + part_mass * about_com)
    return mass, com, inertia


def quaternion_rotation(quaternion: Quaternion) -> Matrix3:
    """Rotation matrix (3, 3) of a quaternion (4,) of any length but zero; NumPy in, NumPy out."""
    xp = array_module(quaternion)
    unit = quaternion / xp.sqrt(xp.sum(quaternion * quaternion))
    return xp.stack([xp.stack(row) for row in quaternion_rows(tuple(unit))])
