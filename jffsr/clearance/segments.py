"""Nearest points of a segment to another, and to a box, in closed form."""

from __future__ import annotations

from types import ModuleType

from jffsr.clearance.numerics import clipped, computed_once, held, larger, largest, root, smaller
from jffsr.spatial.components import Components, add, cross, dot, scale, subtract
from jffsr.types import Array

# Squares of lengths, m^2, and of sines: below them a segment is a point, two are parallel.
_POINT, _PARALLEL = 1e-30, 1e-24
# m, further than anything overlaps.
_NEVER = 1e9


def between_segments(xp: ModuleType, away: Components, a: Components, b: Components) -> Components:
    """The shortest way, m, from segment A to segment B, given half of each and the way from centre to centre.

    Lumelsky's clamping of the unclamped solution (Ericson 2005, section 5.1.9). Products of cross products take the
    place of differences of products, which would lose nearly parallel segments to rounding.
    """
    aa, bb = larger(xp, dot(a, a), _POINT), larger(xp, dot(b, b), _POINT)
    ab, pa, pb = dot(a, b), dot(away, a), dot(away, b)
    normal = cross(a, b)
    square = dot(normal, normal)
    crossing = square > _PARALLEL * aa * bb
    on_a = xp.where(crossing, dot(normal, cross(away, b)) / xp.where(crossing, square, 1.0), 0.0)
    on_a = clipped(xp, on_a, 1.0)
    on_b = clipped(xp, (on_a * ab - pb) / bb, 1.0)
    on_a = clipped(xp, (pa + on_b * ab) / aa, 1.0)
    return subtract(add(away, scale(on_b, b)), scale(on_a, a))


def box_to_segment(
    xp: ModuleType, centre: Components, along: Components, half: Components
) -> tuple[Components, Array]:
    """The shortest way, m, from a box to a segment, in the box's frame and from its centre; and the signed distance.

    Outside, the squared distance of a point that moves along the segment is convex with a slope in straight pieces
    that meet where it crosses a face's plane: the piece that changes sign holds the nearest point. Where they cross
    the distance is minus the least depth over the separating axes, faces and edges, and the way is zero.
    """
    point = _nearest_place(xp, centre, along, half)
    outside = tuple(_beyond(xp, c + point * u, h) for c, u, h in zip(centre, along, half, strict=True))
    length, depth = computed_once(xp, (root(xp, dot(outside, outside)), _depth(xp, centre, along, half)))
    return outside, xp.where(length > 0, length, depth)


def _beyond(xp: ModuleType, x: Array, half: Array) -> Array:
    """How far x is beyond [-half, half]; zero within."""
    return x - clipped(xp, x, half)


def _nearest_place(xp: ModuleType, centre: Components, along: Components, half: Components) -> Array:
    """Where on the segment, in [-1, 1], the point nearest to the box is."""
    axes = list(zip(centre, along, half, strict=True))

    def slope(t: Array) -> Array:
        return sum(u * _beyond(xp, c + t * u, h) for c, u, h in axes)

    crossings = []
    for c, u, h in axes:
        moving = xp.abs(u) > _POINT
        inverse = 1 / xp.where(moving, u, 1.0)
        crossings += [clipped(xp, (side - c) * inverse, 1.0) for side in (-h, h)]
    low, high = -1.0, 1.0
    for t in computed_once(xp, held(xp, crossings)):
        here = slope(t)
        low = xp.where(here <= 0, larger(xp, low, t), low)
        high = xp.where(here >= 0, smaller(xp, high, t), high)
    # No crossing lies between the two, so that the slope is straight there: one step of Newton's method is exact, and
    # has the derivative of the nearest place.
    middle = held(xp, computed_once(xp, 0.5 * (low + high)))
    stiffness = sum(xp.where(xp.abs(c + middle * u) > h, u * u, 0.0) for c, u, h in axes)
    stiff = stiffness > _POINT
    step = slope(middle) / xp.where(stiff, stiffness, 1.0)
    return clipped(xp, middle - xp.where(stiff, step, 0.0), 1.0)


def _depth(xp: ModuleType, centre: Components, along: Components, half: Components) -> Array:
    """Signed distance of a crossing segment and box: the largest gap over the separating axes, negative."""
    gaps = [xp.abs(c) - h - xp.abs(u) for c, u, h in zip(centre, along, half, strict=True)]
    for j, k in ((1, 2), (2, 0), (0, 1)):
        length = root(xp, along[j] ** 2 + along[k] ** 2)
        usable = length > 1e-9
        reach = half[j] * xp.abs(along[k]) + half[k] * xp.abs(along[j])
        over = xp.abs(centre[k] * along[j] - centre[j] * along[k]) - reach
        gaps.append(xp.where(usable, over / xp.where(usable, length, 1.0), -_NEVER))
    return largest(xp, gaps)
