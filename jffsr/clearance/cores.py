"""Signed distance of solids of which one at least has a segment for its core."""

from __future__ import annotations

from types import ModuleType

from jffsr.clearance.boxes import BLEND
from jffsr.clearance.numerics import computed_once, root, smooth_step
from jffsr.clearance.placed import Placed, gap_along, unit
from jffsr.clearance.segments import between_segments, box_to_segment
from jffsr.spatial.components import Components, dot, rows_times, rows_transposed_times, subtract
from jffsr.types import Array


def segment_segment_distance(xp: ModuleType, a: Placed, b: Placed) -> Array:
    """Signed distance (k, ...), m, of solids with segments for cores; exact for spheres and capsules."""
    away = subtract(b.centre, a.centre)
    way = computed_once(xp, between_segments(xp, away, a.along(), b.along()))
    return _tightened(xp, way, root(xp, dot(way, way)), away, a, b)


def box_segment_distance(xp: ModuleType, a: Placed, b: Placed) -> Array:
    """Signed distance (k, ...), m, of solids with a box, a, and a segment, b, for cores; exact for box and capsule."""
    away = subtract(b.centre, a.centre)
    rows = tuple(zip(*a.columns, strict=True))
    centre = rows_transposed_times(rows, away)
    along = rows_transposed_times(rows, b.along())
    way, length = computed_once(xp, box_to_segment(xp, centre, along, a.half))
    return _tightened(xp, rows_times(rows, way), length, away, a, b)


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
