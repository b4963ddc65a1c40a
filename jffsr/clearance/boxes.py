"""Signed distance of two solids with box cores."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from jffsr.clearance.numerics import computed_once, held, largest, root, smooth_step
from jffsr.clearance.placed import Placed, extent, extent_along_axis, gap_along, unit
from jffsr.clearance.segments import box_to_segment
from jffsr.spatial.components import (
    Components,
    add,
    cross,
    dot,
    rows_times,
    rows_transposed_times,
    scale,
    subtract,
)
from jffsr.types import Array

# The twelve edges of a box: where their middles are and which way they run, per half side.
_MIDDLES = np.array(
    [np.insert([s, t], axis, 0.0) for axis in range(3) for s in (-1.0, 1.0) for t in (-1.0, 1.0)]
)
_ALONG = np.repeat(np.eye(3), 4, axis=0)
_PARALLEL = 1e-8
# The share of the slack over which the direction between the cores gains its full say.
BLEND = 0.25


def box_box_distance(xp: ModuleType, a: Placed, b: Placed) -> Array:
    """Signed distance (k, ...), m, exact for two boxes: the largest gap along the directions that can be the best.

    If a face of A holds its nearest point, the face's normal is the best direction, else the way from an edge of A to
    B. Boxes that overlap are parted the shortest way along a face's normal of either or a product of two edges.
    """
    away = subtract(b.centre, a.centre)
    gaps = []
    for own, other in ((a, b), (b, a)):
        for axis, column in enumerate(own.columns):
            reach = extent_along_axis(axis, own) + extent(xp, column, other)
            gaps.append(xp.abs(dot(column, away)) - reach)
    for one in a.columns:
        for other in b.columns:
            normal = cross(one, other)
            length = root(xp, dot(normal, normal))
            usable = length > _PARALLEL
            direction = scale(1 / xp.where(usable, length, 1.0), normal)
            gaps.append(xp.where(usable, gap_along(xp, direction, away, a, b), gaps[0]))
    gap = largest(xp, gaps)
    way, length = computed_once(xp, _way_from_edges(xp, a, b))
    direction, apart = unit(xp, way, length)
    certain = smooth_step(xp, length / (BLEND * (a.slack + b.slack) + 1e-12))
    more = largest(xp, [gap_along(xp, direction, away, a, b) - gap, xp.zeros_like(gap)])
    return gap + xp.where(apart, certain * more, 0.0)


def _way_from_edges(xp: ModuleType, a: Placed, b: Placed) -> tuple[Components, Array]:
    """The shortest way (k, ...), m, in I between the edges of core A and core B, and its length, below zero inside."""
    rows = tuple(zip(*b.columns, strict=True))
    middle = rows_transposed_times(rows, subtract(a.centre, b.centre))
    sides = [rows_transposed_times(rows, scale(h, c)) for h, c in zip(a.half, a.columns, strict=True)]

    def edges(weights: np.ndarray) -> Components:
        factors = weights.reshape(12, 3, *(1,) * middle[0].ndim)
        return tuple(sum(factors[:, i] * sides[i][k] for i in range(3)) for k in range(3))

    centre = add(tuple(m[None] for m in middle), edges(_MIDDLES))
    found = box_to_segment(xp, centre, edges(_ALONG), tuple(h[None] for h in b.half))
    ways, lengths = computed_once(xp, found)
    nearest = xp.argmin(held(xp, lengths), axis=0)[None]
    way = tuple(xp.take_along_axis(x, nearest, axis=0)[0] for x in ways)
    return rows_times(rows, way), xp.take_along_axis(lengths, nearest, axis=0)[0]
