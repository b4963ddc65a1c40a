"""How the picture is divided: a tile for each replay, and a strip with the clock below them."""

from __future__ import annotations

from typing import NamedTuple

from jffsr.errors import InputError

_BEST_ASPECT = 1.4
_STRIP = 0.085
"""Height of the strip as a share of the picture's."""
_SMALLEST = 120  # pixels


class Tile(NamedTuple):
    """A rectangle of the picture in pixels: left and top corner, width and height."""

    left: int
    top: int
    width: int
    height: int


def tiles(count: int, width: int, height: int) -> list[Tile]:
    """Rectangles for `count` replays in rows, as near as can be to the shape of a screen; a short last row is centred.

    InputError where they would be too small to see anything.
    """
    height -= strip_height(height)

    def merit(columns: int) -> float:
        rows = -(-count // columns)
        aspect = (width / columns) / (height / rows)
        return min(aspect / _BEST_ASPECT, _BEST_ASPECT / aspect) * count / (rows * columns)

    columns = max(range(1, count + 1), key=merit)
    rows = -(-count // columns)
    wide, tall = width // columns, height // rows
    if min(wide, tall) < _SMALLEST:
        raise InputError(
            f"{count} replays in a picture of {width} x {height} pixels: each would have {wide} x {tall}, and needs "
            f"{_SMALLEST} x {_SMALLEST}; show fewer, or make the picture larger"
        )
    found = []
    for number in range(count):
        row, column = divmod(number, columns)
        short = columns - min(columns, count - row * columns)
        found.append(Tile(column * wide + short * wide // 2, row * tall, wide, tall))
    return found


def strip_height(height: int) -> int:
    """Pixels of the strip with clock and time bar in a picture of this height."""
    return max(round(_STRIP * height), 24)
