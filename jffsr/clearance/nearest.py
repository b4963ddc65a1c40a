"""Distance of each pair of bodies, that of their nearest solids, and how it changes when they move.

A distance changes with the relative motion of the two bodies only: six numbers, a force and a moment. `distances` has
them for its derivative. A planner asks for dozens of directional derivatives of one posture; each is then a few
products a pair instead of the derivative of all that led to the distance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from types import ModuleType

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero

from jffsr.clearance.boxes import box_box_distance
from jffsr.clearance.cores import box_segment_distance, segment_segment_distance
from jffsr.clearance.layout import Kind, Layout, SolidNumbers
from jffsr.clearance.numerics import computed_once
from jffsr.clearance.placed import Placed, moved, place
from jffsr.clearance.solids import BOX_CORE, SEGMENT_CORE
from jffsr.spatial.components import Components, Rows, add, cross, dot, scale, subtract
from jffsr.types import Array


def nearest_distances(
    xp: ModuleType, layout: Layout, numbers: SolidNumbers, position: Components, rotation: Rows
) -> Array:
    """Signed distances (p, ...), m, of all pairs of bodies at position (b, ...), m, turned by rotation, in I."""
    solids = computed_once(xp, place(numbers, np.array(layout.bodies), position, rotation))
    found = [distance(xp, a, b) for distance, _, a, b in _compared(xp, layout, solids)]
    return _of_nearest(xp, layout, computed_once(xp, xp.concatenate(found)))[0]


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def distances(layout: Layout, numbers: SolidNumbers, position: Components, rotation: Rows) -> Array:
    """The same, traced; the numbers of the solids are constants of its derivative."""
    return nearest_distances(jnp, layout, numbers, position, rotation)


# Zeros stay symbols: made into arrays, those of the numbers would be asked for where several devices have each its own.
@partial(distances.defjvp, symbolic_zeros=True)
def _distances_jvp(layout, primals, tangents):
    position_dot, rotation_dot = (
        jax.tree.map(_dense, change, is_leaf=lambda x: isinstance(x, SymbolicZero)) for change in tangents[1:]
    )
    value, force, moments = distances_and_forces(layout, *primals)
    spin = _spin(primals[2], rotation_dot)
    first, second = np.array(layout.body_pairs).T
    change = dot(force, tuple(x[second] - x[first] for x in position_dot))
    for moment, bodies in zip(moments, (first, second), strict=True):
        change = change + dot(moment, tuple(x[bodies] for x in spin))
    return value, change


def _dense(change: Array | SymbolicZero) -> Array:
    return jnp.zeros(change.shape, change.dtype) if isinstance(change, SymbolicZero) else change


def distances_and_forces(
    layout: Layout, numbers: SolidNumbers, position: Components, rotation: Rows
) -> tuple[Array, Components, tuple[Components, Components]]:
    """Distances (p, ...), m; their derivative by the second body's place less the first's; and by a turn of each body.

    The turns are about the origins of the bodies' frames, in I, m/rad.
    """
    solids = computed_once(jnp, place(numbers, np.array(layout.bodies), position, rotation))
    found, forces, firsts, seconds = [], [], [], []
    for distance, chosen, a, b in _compared(jnp, layout, solids):
        # Not zeros_like, for the same reason.
        zero = jnp.zeros(b.centre[0].shape, b.centre[0].dtype)
        still = ((zero,) * 3, (zero,) * 3)
        value, pull = jax.vjp(lambda motion, a=a, b=b, d=distance: d(jnp, a, moved(b, *motion)), still)
        force, turn = computed_once(jnp, pull(jnp.ones(value.shape, value.dtype))[0])
        # Turning both solids about a's centre changes nothing.
        turn_a = scale(-1.0, add(turn, cross(subtract(b.centre, a.centre), force)))
        lever_a, lever_b = (
            _lever(layout, position, solid, i) for solid, i in zip((a, b), chosen, strict=True)
        )
        found.append(value)
        forces.append(force)
        firsts.append(subtract(turn_a, cross(lever_a, force)))
        seconds.append(add(turn, cross(lever_b, force)))
    parts = [
        tuple(jnp.concatenate([x[i] for x in part]) for i in range(3)) for part in (forces, firsts, seconds)
    ]
    flip = _flipped(layout).reshape(-1, *(1,) * (parts[0][0].ndim - 1))
    force = tuple(jnp.where(flip, -x, x) for x in parts[0])
    first = tuple(jnp.where(flip, y, x) for x, y in zip(parts[1], parts[2], strict=True))
    second = tuple(jnp.where(flip, x, y) for x, y in zip(parts[1], parts[2], strict=True))
    every = computed_once(jnp, (jnp.concatenate(found), (force, first, second)))
    value, (force, first, second) = computed_once(jnp, _of_nearest(jnp, layout, *every))
    return value, force, (first, second)


def _compared(xp: ModuleType, layout: Layout, solids: Placed) -> Iterator:
    """Each kind of pairs of solids: the function of their distance, their numbers (2, k), and both, placed."""
    for kind, pairs in layout.groups:
        chosen = np.array(pairs).T
        a, b = (jax.tree.map(lambda x, i=end: x[i], solids) for end in chosen)
        yield _distance_of(kind), chosen, *computed_once(xp, (a, b))


def _distance_of(kind: Kind) -> Callable[[ModuleType, Placed, Placed], Array]:
    if kind.second == BOX_CORE:
        return box_box_distance
    between = segment_segment_distance if kind.first == SEGMENT_CORE else box_segment_distance
    return partial(between, ends=kind.ends)


def _of_nearest(xp: ModuleType, layout: Layout, distance: Array, also=()):
    """For each pair of bodies the distance (p, ...) of its nearest solids, and what else is known of them."""
    table = layout.nearest_table
    nearest, known = distance[table[:, 0]], jax.tree.map(lambda x: x[table[:, 0]], also)
    for column in table.T[1:]:
        other = distance[column]
        closer = other < nearest
        nearest = xp.where(closer, other, nearest)
        known = jax.tree.map(lambda x, y, c=closer, i=column: xp.where(c, y[i], x), known, also)
    return nearest, known


def _flipped(layout: Layout) -> np.ndarray:
    """Which pairs of solids (k,) are in the other order than the bodies that they are on."""
    owner = {
        k: pair for pair, members in zip(layout.body_pairs, layout.members, strict=True) for k in members
    }
    return np.array([layout.bodies[a] != owner[k][0] for k, (a, _) in enumerate(layout.solid_pairs)])


def _lever(layout: Layout, position: Components, solid: Placed, chosen: np.ndarray) -> Components:
    """From the origin of each solid's body to its centre, m."""
    bodies = np.array(layout.bodies)[chosen]
    return subtract(solid.centre, tuple(x[bodies] for x in position))


def _spin(rotation: Rows, change: Rows) -> Components:
    """The turn in I that a change of rotation matrices is, rad."""
    columns, changes = zip(*rotation, strict=True), zip(*change, strict=True)
    products = [cross(c, d) for c, d in zip(columns, changes, strict=True)]
    return scale(0.5, add(add(products[0], products[1]), products[2]))
