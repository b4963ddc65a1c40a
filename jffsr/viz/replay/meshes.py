"""Polygons as triangles for viewers: corners are shared where a surface is smooth, and apart where it has an edge."""

from __future__ import annotations

import numpy as np

_CREASE = np.cos(np.deg2rad(40.0))
"""Faces that meet at a larger angle have an edge between them."""


def triangles(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3) and triangles (t, 3) of polygons (f, 4, 3), which repeat a corner where they are triangles.

    A viewer that makes a vertex's normal from the triangles around it shades round surfaces smoothly and leaves edges
    sharp. Polygons without area are left out.
    """
    corners = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    size = np.ptp(corners.reshape(-1, 3), axis=0).max(initial=0.0)
    whole = areas > 1e-12 * size**2
    corners, normals = corners[whole], normals[whole] / areas[whole, None]
    if not len(corners):
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    points, place = np.unique(np.round(corners.reshape(-1, 3) / size, 7), axis=0, return_inverse=True)
    vertices: list[np.ndarray] = []
    # Of every point, the vertices that it has become so far, each with the normal of its first triangle.
    made: list[list[tuple[int, np.ndarray]]] = [[] for _ in points]
    indices = np.empty(3 * len(corners), int)
    for corner, point in enumerate(place.ravel()):
        normal = normals[corner // 3]
        number = next((n for n, other in made[point] if normal @ other > _CREASE), None)
        if number is None:
            number = len(vertices)
            vertices.append(points[point] * size)
            made[point].append((number, normal))
        indices[corner] = number
    return np.array(vertices), indices.reshape(-1, 3)


def merged(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one."""
    shifts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate([f + s for (_, f), s in zip(parts, shifts, strict=False)])
