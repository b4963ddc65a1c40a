"""The normals of a mesh as it is drawn: smooth where it is round, sharp at its edges."""

from __future__ import annotations

import numpy as np

_CREASE = np.cos(np.deg2rad(40.0))
"""Faces that meet at a larger angle have an edge between them."""


def corner_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (f, 3, 3) of the corners of triangles (f, 3) of vertices (v, 3).

    A corner's normal is the mean, by area, of those of the triangles around its vertex that lie nearly in one plane
    with its own; two sides of one surface, which share vertices, thus keep apart.
    """
    points = vertices[faces]
    areas = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    flat = _unit(areas)
    found = np.empty((len(faces), 3, 3))
    order = np.argsort(faces, axis=None, kind="stable")
    starts = np.flatnonzero(np.diff(faces.ravel()[order], prepend=-1))
    for corners in np.split(order, starts[1:]):
        around = corners // 3
        level = flat[around] @ flat[around].T > _CREASE
        found[around, corners % 3] = _unit(level @ areas[around] + 1e-12 * flat[around])
    return found


def _unit(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    upright = np.zeros_like(vectors)
    upright[..., 2] = 1.0
    return np.where(lengths > 0, vectors / np.where(lengths > 0, lengths, 1.0), upright)
