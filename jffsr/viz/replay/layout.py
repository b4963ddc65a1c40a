"""From where replays are looked at, and where several stand beside each other in that picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from jffsr.viz.replay.replay import Replay

_GAP = 0.06  # of the widest
_FIELD = np.deg2rad(35.0)
_SHAPE = 1.2
_MARGIN, _OVER = 1.05, 0.03
"""Room around everything; how far over a replay its title stands, as a share of its size."""
_SPACE = (0.5, -1.0, 0.55)
_FLAT = (0.0, -0.45, 1.0)
"""To the reader: of a motion in the x-y plane from above, a little from the side, so that bodies have a shape."""


@dataclass(frozen=True)
class View:
    """A camera: position, look_at and up (3,), m, and its field of view from top to bottom, fov, rad."""

    position: np.ndarray
    look_at: np.ndarray
    up: np.ndarray
    fov: float


def places(replays: Sequence[Replay]) -> np.ndarray:
    """Shifts (k, 3), m, that put the replays side by side and in rows on the page, none before another."""
    boxes = np.array([replay.extent() for replay in replays])
    _, right, up = _directions(replays)
    sides = boxes[:, 1] - boxes[:, 0]
    wide, tall = (1.0 + _GAP) * (sides @ np.abs(right)).max(), (1.0 + _GAP) * (sides @ np.abs(up)).max()
    columns = _columns(len(replays), wide, tall)
    row, column = np.divmod(np.arange(len(replays)), columns)
    shifts = np.multiply.outer(column * wide, right) - np.multiply.outer(row * tall, up)
    return shifts - shifts.mean(axis=0) - 0.5 * (boxes[:, 0] + boxes[:, 1])


def view_of(replays: Sequence[Replay]) -> View:
    """The camera that sees all of the replays in their places, in a picture 1.2 times as wide as high."""
    direction, right, up = _directions(replays)
    shifts = places(replays)
    points = [replay.points + shift for replay, shift in zip(replays, shifts, strict=True)]
    if len(replays) > 1:
        points += [title_place(replay)[None] + shift for replay, shift in zip(replays, shifts, strict=True)]
    points = np.concatenate(points)
    across, upward = points @ right, points @ up
    middle = 0.5 * (across.min() + across.max()) * right + 0.5 * (upward.min() + upward.max()) * up
    middle = middle + np.mean(points @ direction) * direction
    seen, half = points - middle, np.tan(0.5 * _FIELD)
    # How far away each corner just comes into the picture.
    needed = np.maximum(np.abs(seen @ up), np.abs(seen @ right) / _SHAPE) / half + seen @ direction
    return View(middle + _MARGIN * needed.max() * direction, middle, np.array([0.0, 0.0, 1.0]), float(_FIELD))


def title_place(replay: Replay) -> np.ndarray:
    """Where the title of one replay of several stands, (3,): over its middle."""
    low, high = replay.extent()
    return np.array([*(0.5 * (low + high))[:2], high[2] + _OVER * (high - low).max()])


def _columns(count: int, wide: float, tall: float) -> int:
    """In how many columns replays of this size are seen largest."""
    return min(range(1, count + 1), key=lambda c: max(c * wide / _SHAPE, -(-count // c) * tall))


def _directions(replays: Sequence[Replay]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """To the reader, to the right and up on the page, (3,) each."""
    direction = np.array(_FLAT if all(map(_is_flat, replays)) else _SPACE)
    direction = direction / np.linalg.norm(direction)
    right = np.cross([0.0, 0.0, 1.0], direction)
    right = right / np.linalg.norm(right)
    return direction, right, np.cross(direction, right)


def _is_flat(replay: Replay) -> bool:
    """Whether nothing leaves its height."""
    heights = [np.ptp(solid.position[:, 2]) for solid in replay.solids]
    low, high = replay.extent()
    return max(heights, default=0.0) < 1e-9 * (high - low).max()
