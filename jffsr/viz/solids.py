"""Shapes as polygons: what bounds a box, a cylinder or a mesh, ready to shade and to sort by depth."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from jffsr.robots.geometry import BOX, CAPSULE, CYLINDER, ELLIPSOID, MESH, SPHERE, Shape

_AROUND = 24  # corners of a circle
_MOST_FACES = 5000

# Corners of each face of a box with half sides 1, counter-clockwise seen from outside.
_BOX = np.array(
    [
        [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1]],
        [[-1, 1, -1], [-1, -1, -1], [-1, -1, 1], [-1, 1, 1]],
        [[1, 1, -1], [-1, 1, -1], [-1, 1, 1], [1, 1, 1]],
        [[-1, -1, -1], [1, -1, -1], [1, -1, 1], [-1, -1, 1]],
        [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
        [[-1, 1, -1], [1, 1, -1], [1, -1, -1], [-1, -1, -1]],
    ],
    dtype=float,
)


def shape_faces(shape: Shape) -> np.ndarray:
    """The faces (f, 4, 3), m, of a shape in the frame of its body, counter-clockwise seen from outside.

    A triangle repeats its last corner. A mesh of more than 5,000 faces is drawn as its convex hull; the
    corners of any other are in the file's order.
    """
    size = shape.size
    if shape.kind == BOX:
        faces = _BOX * size
    elif shape.kind == SPHERE:
        faces = size[0] * _lathe(_arc(-90, 90))
    elif shape.kind == ELLIPSOID:
        faces = size * _lathe(_arc(-90, 90))
    elif shape.kind == CYLINDER:
        faces = _cylinder(*size)
    elif shape.kind == CAPSULE:
        faces = _capsule(*size)
    elif shape.kind == MESH:
        faces = _mesh(np.asarray(shape.vertices, float), np.asarray(shape.faces))
    else:
        raise ValueError(f"shape '{shape.name}' is of the unknown kind '{shape.kind}'")
    return faces @ shape.rotation.T + shape.position


def capsule_between(start: np.ndarray, end: np.ndarray, radius: float) -> np.ndarray:
    """The faces (f, 4, 3) of a capsule whose straight part goes from start (3,) to end (3,)."""
    turn, length = _along(start, end)
    return _capsule(radius, 0.5 * length) @ turn.T + 0.5 * (start + end)


def cylinder_between(start: np.ndarray, end: np.ndarray, radius: float) -> np.ndarray:
    """The faces (f, 4, 3) of a cylinder whose caps are centred on start (3,) and end (3,)."""
    turn, length = _along(start, end)
    return _cylinder(radius, 0.5 * length) @ turn.T + 0.5 * (start + end)


def _along(start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, float]:
    """A rotation (3, 3) that takes z to the way from start (3,) to end (3,), and how long that is."""
    along = end - start
    length = np.linalg.norm(along)
    z = along / length if length > 0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1), float(length)


def refined(faces: np.ndarray, longest: float) -> np.ndarray:
    """The faces cut into smaller ones, no side much longer than `longest`: small faces sort well by depth."""
    pieces = []
    for face in faces:
        sides = np.linalg.norm(face - np.roll(face, -1, axis=0), axis=1)
        u = np.linspace(0, 1, 1 + max(1, int(np.ceil(max(sides[0], sides[2]) / longest))))
        v = np.linspace(0, 1, 1 + max(1, int(np.ceil(max(sides[1], sides[3]) / longest))))
        if len(u) == len(v) == 2:
            pieces.append(face[None])
            continue
        low = face[0] + u[:, None] * (face[1] - face[0])
        high = face[3] + u[:, None] * (face[2] - face[3])
        grid = low[:, None] + v[:, None] * (high - low)[:, None]
        corners = (grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:])
        pieces.append(np.stack(corners, axis=2).reshape(-1, 4, 3))
    return np.concatenate(pieces)


def outward(faces: np.ndarray) -> np.ndarray:
    """Unit normals (f, 3) of faces (f, 4, 3); zero where a face has no area."""
    normals = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)


def _arc(start: float, end: float) -> np.ndarray:
    """Points (k, 2), radius and height, of a unit half circle from one latitude to another, deg."""
    latitude = np.deg2rad(np.linspace(start, end, 1 + int(abs(end - start) / 15)))
    points = np.stack([np.cos(latitude), np.sin(latitude)], axis=1)
    return np.where(np.abs(points) < 1e-15, 0.0, points)


def _lathe(profile: np.ndarray) -> np.ndarray:
    """The faces that a profile (k, 2) of radii and heights, from the bottom up, sweeps around z."""
    angle = np.linspace(0, 2 * np.pi, _AROUND + 1)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate(
        [
            profile[:, None, :1] * ring,
            np.broadcast_to(profile[:, None, 1:], (len(profile), _AROUND + 1, 1)),
        ],
        axis=2,
    )
    corners = (points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1])
    return np.stack(corners, axis=2).reshape(-1, 4, 3)


def _cylinder(radius: float, half_length: float) -> np.ndarray:
    return _lathe(
        np.array([[0, -half_length], [radius, -half_length], [radius, half_length], [0, half_length]])
    )


def _capsule(radius: float, half_length: float) -> np.ndarray:
    lift = np.array([0.0, half_length])
    return _lathe(np.concatenate([radius * _arc(-90, 0) - lift, radius * _arc(0, 90) + lift]))


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    if len(faces) > _MOST_FACES:
        hull = ConvexHull(vertices)
        corners = vertices[hull.simplices]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = np.einsum("fi,fi->f", normals, hull.equations[:, :3]) < 0
        corners[inward] = corners[inward][:, ::-1]
    else:
        corners = vertices[faces]
    return np.concatenate([corners, corners[:, -1:]], axis=1)
