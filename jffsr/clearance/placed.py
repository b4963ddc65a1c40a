"""Solids where their bodies are, in the inertial frame: components over (solids, ...) with any batch behind."""

from __future__ import annotations

from types import ModuleType
from typing import NamedTuple

from jffsr.clearance.numerics import held, root
from jffsr.spatial.components import Components, Rows, add, cross, dot, rows_times
from jffsr.types import Array

_SMALL = 1e-12
# Less than this is rounding: the cosine of a direction and an axis, and such a product times a radius, m.
_SQUARE = 1e-9


class Placed(NamedTuple):
    """Solids in I: centre, m, and the columns of their axes, components (k, ...); sizes as in Solid, (k, 1...)."""

    centre: Components
    columns: tuple[Components, Components, Components]
    half: Components
    radius: Array
    slack: Array
    box: Components
    ball: Array
    ellipsoid: Components

    def along(self) -> Components:
        """Half of a segment core, m, from its centre to its end."""
        return tuple(self.half[2] * x for x in self.columns[2])


def place(numbers, bodies, position: Components, rotation: Rows) -> Placed:
    """Solids of the given `SolidNumbers` on the bodies (k,), of bodies at position (b, ...) turned by rotation."""
    position = tuple(x[bodies] for x in position)
    rotation = tuple(tuple(x[bodies] for x in row) for row in rotation)
    behind = (slice(None),) + (None,) * (position[0].ndim - 1)

    def vector(values: Array) -> Components:
        return tuple(values[:, i][behind] for i in range(3))

    return Placed(
        centre=add(position, rows_times(rotation, vector(numbers.centre))),
        columns=tuple(rows_times(rotation, vector(numbers.axes[:, :, i])) for i in range(3)),
        half=vector(numbers.half),
        radius=numbers.radius[behind],
        slack=numbers.slack[behind],
        box=vector(numbers.box),
        ball=numbers.ball[behind],
        ellipsoid=vector(numbers.ellipsoid),
    )


def extent(xp: ModuleType, direction: Components, solid: Placed) -> Array:
    """Largest n . x, m, of a solid's points x about its centre, for unit directions n in I."""
    along = [dot(direction, column) for column in solid.columns]
    straight = sum(half * _magnitude(xp, n) for half, n in zip(solid.box, along, strict=True))
    square = sum((axis * n) ** 2 for axis, n in zip(solid.ellipsoid, along, strict=True))
    return straight + solid.ball + xp.where(square > _SQUARE**2, root(xp, square), held(xp, root(xp, square)))


def _magnitude(xp: ModuleType, x: Array) -> Array:
    """|x|, whose derivative is zero where x is zero but for rounding.

    The best direction is often square to an axis, and stays so: the sign of their product is rounding then, and need
    not be the same in all the places where a compiler computes it, so that what should cancel would not.
    """
    size = xp.abs(x)
    return xp.where(size > _SQUARE, size, held(xp, size))


def gap_along(xp: ModuleType, direction: Components, away: Components, a: Placed, b: Placed) -> Array:
    """How far apart, m, two solids are along unit directions; `away` leads from the centre of a to that of b.

    The better one of the direction and its opposite; never more than their signed distance.
    """
    return xp.abs(dot(direction, away)) - extent(xp, direction, a) - extent(xp, direction, b)


def extent_along_axis(axis: int, solid: Placed) -> Array:
    """The same along the solid's own axis of this number."""
    return solid.box[axis] + solid.ball + solid.ellipsoid[axis]


def unit(xp: ModuleType, vector: Components, length: Array) -> tuple[Components, Array]:
    """Unit vectors, and where the length, m, is enough to have one; elsewhere the vector as it is."""
    long = length > _SMALL
    inverse = 1 / xp.where(long, length, 1.0)
    return tuple(inverse * x for x in vector), long


def moved(solid: Placed, shift: Components, turn: Components) -> Placed:
    """A solid after a small shift, m, and a small turn, rad, about its centre; in I, to the first order."""
    columns = tuple(add(column, cross(turn, column)) for column in solid.columns)
    return solid._replace(centre=add(solid.centre, shift), columns=columns)
