"""Vectors and matrices as tuples of their components, for arithmetic over long batches.

Each component is an array over whatever batch there is, so that every operation is one long contiguous loop
that the compiler can vectorise and fuse. Small matrices in the last two axes of an array, the usual layout, go
through one library call each on the CPU.
"""

from __future__ import annotations

from jffsr.types import Array

Components = tuple[Array, Array, Array]
Rows = tuple[Components, Components, Components]
Symmetric = tuple[Array, Array, Array, Array, Array, Array]
"""Elements xx, yy, zz, xy, xz, yz of a symmetric matrix."""


def add(a: Components, b: Components) -> Components:
    """a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Components, b: Components) -> Components:
    """a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(factor: Array, a: Components) -> Components:
    """factor a."""
    return (factor * a[0], factor * a[1], factor * a[2])


def dot(a: Components, b: Components) -> Array:
    """a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Components, b: Components) -> Components:
    """a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def rows_times(m: Rows, v: Components) -> Components:
    """M v."""
    return (dot(m[0], v), dot(m[1], v), dot(m[2], v))


def rows_product(a: Rows, b: Rows) -> Rows:
    """A B."""
    columns = tuple(zip(*b, strict=True))
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def symmetric_elements(matrix: Array) -> Symmetric:
    """The six elements, in the order of `Symmetric`, of symmetric matrices (..., 3, 3)."""
    return tuple(matrix[..., r, k] for r, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))


def symmetric_times(s: Symmetric, v: Components) -> Components:
    """S v."""
    xx, yy, zz, xy, xz, yz = s
    return rows_times(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), v)


def symmetric_inverse(s: Symmetric) -> Symmetric:
    """S^-1 by cofactors."""
    xx, yy, zz, xy, xz, yz = s
    cofactors = (
        yy * zz - yz * yz,
        xx * zz - xz * xz,
        xx * yy - xy * xy,
        xz * yz - xy * zz,
        xy * yz - xz * yy,
        xy * xz - xx * yz,
    )
    inverse = 1 / (xx * cofactors[0] + xy * cofactors[3] + xz * cofactors[4])
    return tuple(inverse * c for c in cofactors)


def point_inertia(r: Components) -> Symmetric:
    """|r|^2 1 - r r'."""
    x, y, z = r
    return (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)


def quaternion_rows(q: tuple[Array, Array, Array, Array]) -> Rows:
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def rows_transposed_times(m: Rows, v: Components) -> Components:
    """M' v."""
    return tuple(dot(column, v) for column in zip(*m, strict=True))


def symmetric_turned(m: Rows, s: Symmetric) -> Symmetric:
    """M S M'."""
    xx, yy, zz, xy, xz, yz = s
    half = rows_product(m, ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    return tuple(dot(half[r], m[k]) for r, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
