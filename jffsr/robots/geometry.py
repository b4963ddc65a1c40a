"""Shapes fixed on a robot's bodies, for drawing and for clearance; they have no part in its dynamics."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

BOX, SPHERE, CYLINDER, CAPSULE, ELLIPSOID, MESH = "box", "sphere", "cylinder", "capsule", "ellipsoid", "mesh"
KINDS = (BOX, SPHERE, CYLINDER, CAPSULE, ELLIPSOID, MESH)
NUM_SIZES = {BOX: 3, SPHERE: 1, CYLINDER: 2, CAPSULE: 2, ELLIPSOID: 3, MESH: 0}
"""How many numbers of `Shape.size` each kind has."""

VISUAL, COLLISION = "visual", "collision"


@dataclass(frozen=True, eq=False)
class Shape:
    """A solid fixed on a link or body.

    position (3,), m, and rotation (3, 3) place its frame in that of `body`. size, m: half sides of a box,
    radius of a sphere, radius and half length of a cylinder or a capsule (its straight part) along z,
    semi-axes of an ellipsoid, nothing for a mesh, which has vertices (v, 3), m, and faces (f, 3), indices of
    vertices. roles says whether it is seen (visual), kept clear of (collision), or both; colour is RGBA in
    [0, 1], None where the file names none.
    """

    name: str
    kind: str
    body: str
    position: np.ndarray
    rotation: np.ndarray
    size: np.ndarray = field(default_factory=lambda: np.zeros(0))
    vertices: np.ndarray | None = None
    faces: np.ndarray | None = None
    roles: tuple[str, ...] = (VISUAL, COLLISION)
    colour: tuple[float, float, float, float] | None = None

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which points (k, 3), m, in the frame of the body lie inside, boolean (k,); of a mesh none."""
        size, x = self.size, (np.asarray(points) - self.position) @ self.rotation
        if self.kind == BOX:
            return np.all(np.abs(x) < size, axis=-1)
        if self.kind == SPHERE:
            return np.linalg.norm(x, axis=-1) < size[0]
        if self.kind == ELLIPSOID:
            return np.sum((x / size) ** 2, axis=-1) < 1
        if self.kind == CYLINDER:
            return (np.hypot(x[:, 0], x[:, 1]) < size[0]) & (np.abs(x[:, 2]) < size[1])
        if self.kind == CAPSULE:
            beyond = np.maximum(np.abs(x[:, 2]) - size[1], 0)
            return np.sqrt(x[:, 0] ** 2 + x[:, 1] ** 2 + beyond**2) < size[0]
        return np.zeros(len(x), dtype=bool)


@dataclass(frozen=True, eq=False)
class Geometry:
    """The shapes of a robot; two of the same content are equal, so that they share compiled programs."""

    shapes: tuple[Shape, ...] = ()

    @cached_property
    def _digest(self) -> bytes:
        digest = hashlib.sha256()
        for shape in self.shapes:
            words = (shape.name, shape.kind, shape.body, shape.roles, shape.colour)
            digest.update(repr(words).encode())
            for array in (shape.position, shape.rotation, shape.size, shape.vertices, shape.faces):
                if array is None:
                    digest.update(b"none")
                else:
                    digest.update(repr((array.shape, array.dtype.str)).encode() + array.tobytes())
        return digest.digest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Geometry) and self._digest == other._digest

    def __hash__(self) -> int:
        return hash(self._digest)

    def on_body(self, name: str, role: str | None = None) -> tuple[Shape, ...]:
        """The shapes fixed on the named body, all of them or those of one role."""
        return tuple(s for s in self.shapes if s.body == name and (role is None or role in s.roles))
