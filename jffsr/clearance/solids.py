"""Shapes as solids whose distance has a closed form, and whose extent along a direction is exact.

Each solid is held twice. The *enclosure* is a core, a segment or a box, grown by a ball: its nearest point to another
is found in closed form. The *extent* h(n) = max n . x over the shape itself, about its centre, is

    h(n) = sum_i b_i |n_i| + r |n| + sqrt(sum_i (e_i n_i)^2),

the sum of a box b, a ball r and an ellipsoid e; with these boxes, spheres, capsules, cylinders and ellipsoids are
exact. Of two convex solids n . (c_B - c_A) - h_A(n) - h_B(n) is never more than the signed distance, for any unit n,
and equal to it for the best (the support function's duality; Ericson, Real-Time Collision Detection, 2005, chapter
9): the enclosures find n, the extents measure along it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jffsr.robots.geometry import CAPSULE, CYLINDER, ELLIPSOID, MESH, SPHERE, Shape

SEGMENT_CORE, BOX_CORE = "segment", "box"

# A solid flatter than this share of its middle half side is a plate: a capsule around it would be mostly empty.
_PLATE = 1 / 3
# How far the corners of the enclosing box of a round solid stand out, per radius.
_CORNER = np.sqrt(2.0) - 1


@dataclass(frozen=True)
class Solid:
    """A shape on body `body` (its number), in the body's frame.

    centre (3,), m; axes (3, 3), the solid's own axes as columns; core, which of the two; half (3,), m, half sides of
    the core, a segment's along the third axis; has_ends, whether flat ends square to that axis count by themselves;
    radius, m, of the ball around the core; slack, m, about how far the enclosure reaches beyond the shape, zero for
    none; box (3,), ball () and ellipsoid (3,), m, of the extent.
    """

    body: int
    centre: np.ndarray
    axes: np.ndarray
    core: str
    half: np.ndarray
    has_ends: bool
    radius: float
    slack: float
    box: np.ndarray
    ball: float
    ellipsoid: np.ndarray


def solid_of(shape: Shape, body: int, as_capsule: bool) -> Solid:
    """The solid of a shape; as_capsule: boxes, ellipsoids and meshes get a capsule around them unless they are plates.

    Else the flat ends of cylinders count by themselves. A mesh becomes the box around its vertices along their
    principal axes.
    """
    centre, axes = np.asarray(shape.position, float), np.asarray(shape.rotation, float)
    if shape.kind in (SPHERE, CAPSULE, CYLINDER):
        return _round(shape, body, centre, axes, not as_capsule)
    if shape.kind == MESH:
        centre, axes, half = _box_around(np.asarray(shape.vertices, float) @ axes.T + centre)
    else:
        half = np.asarray(shape.size, float)
    order = np.argsort(half, kind="stable")
    axes, half = axes[:, order], half[order]
    zero = np.zeros(3)
    box, ellipsoid = (zero, half) if shape.kind == ELLIPSOID else (half, zero)
    if as_capsule and half[0] > _PLATE * half[1]:
        around = np.hypot(half[0], half[1]) if shape.kind != ELLIPSOID else half[1]
        core = np.array([0.0, 0.0, half[2]])
        return Solid(body, centre, axes, SEGMENT_CORE, core, False, around, around, box, 0.0, ellipsoid)
    slack = _CORNER * half[1] if shape.kind == ELLIPSOID else 0.0
    return Solid(body, centre, axes, BOX_CORE, half, False, 0.0, slack, box, 0.0, ellipsoid)


def _round(shape: Shape, body: int, centre: np.ndarray, axes: np.ndarray, has_ends: bool) -> Solid:
    """Sphere, capsule or cylinder: a segment along z and a ball, or the box around a flat cylinder."""
    radius, length = float(shape.size[0]), float(shape.size[1]) if shape.kind != SPHERE else 0.0
    zero, along = np.zeros(3), np.array([0.0, 0.0, length])
    if shape.kind != CYLINDER:
        return Solid(body, centre, axes, SEGMENT_CORE, along, False, radius, radius, along, radius, zero)
    disc = np.array([radius, radius, 0.0])
    if length <= _PLATE * radius:
        return Solid(
            body, centre, axes, BOX_CORE, disc + along, False, 0.0, _CORNER * radius, along, 0.0, disc
        )
    return Solid(body, centre, axes, SEGMENT_CORE, along, has_ends, radius, radius, along, 0.0, disc)


def _box_around(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Centre (3,), axes (3, 3) and half sides (3,) of the box around points (v, 3) along their principal axes."""
    _, axes = np.linalg.eigh(np.cov(points.T, bias=True))
    along = points @ axes
    low, high = along.min(axis=0), along.max(axis=0)
    return axes @ ((low + high) / 2), axes, (high - low) / 2
