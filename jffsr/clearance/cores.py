"""Signed distance of solids of which one at least has a segment for its core."""

from __future__ import annotations

from types import ModuleType

from jffsr.clearance.boxes import BLEND
from jffsr.clearance.numerics import computed_once, largest, root, smooth_step
from jffsr.clearance.placed import Placed, extent, extent_along_axis, gap_along, unit
from jffsr.clearance.segments import between_segments, box_to_segment
from jffsr.spatial.components import Components, dot, rows_times, rows_transposed_times, subtract
from jffsr.types import Array


def segment_segment_distance(xp: ModuleType, a: Placed, b: Placed, ends: bool = False) -> Array:
    """Signed distance (k, ...), m, of solids with segments for cores; exact for spheres and capsules."""
    away = subtract(b.centre, a.centre)
    way = computed_once(xp, between_segments(xp, away, a.along(), b.along()))
    found = _tightened(xp, way, root(xp, dot(way, way)), away, a, b)
    return largest(xp, [found, _past_end(xp, away, a, b), _past_end(xp, away, b, a)]) if ends else found


def box_segment_distance(xp: ModuleType, a: Placed, b: Placed, ends: bool = False) -> Array:
    """Signed distance (k, ...), m, of solids with a box, a, and a segment, b, for cores; exact for box and capsule."""
    away = subtract(b.centre, a.centre)
    rows = tuple(zip(*a.columns, strict=True))
    centre = rows_transposed_times(rows, away)
    along = rows_transposed_times(rows, b.along())
    way, length = computed_once(xp, box_to_segment(xp, centre, along, a.half))
    found = _tightened(xp, rows_times(rows, way), length, away, a, b)
    return largest(xp, [found, _past_end(xp, away, b, a)]) if ends else found


def _tightened(
    xp: ModuleType, way: Components, length: Array, away: Components, a: Placed, b: Placed
) -> Array:
    """Signed distance by the extents of the shapes along the shortest way between their cores.

    Both it and that of the enclosures are never too large. Near crossing cores the way loses its meaning, and the
    enclosures' takes over.
    """
    around = length - a.radius - b.radius
    direction, apart = unit(xp, way, length)
    more = gap_along(xp, direction, away, a, b) - around
    certain = smooth_step(xp, length / (BLEND * (a.slack + b.slack) + 1e-12))
    return around + xp.where(apart, certain * more, 0.0)


def _past_end(xp: ModuleType, away: Components, own: Placed, other: Placed) -> Array:
    """How far the other solid is past the flat end of one, m: the gap along its axis, never too large either."""
    axis = own.columns[2]
    return xp.abs(dot(axis, away)) - extent_along_axis(2, own) - extent(xp, axis, other)
