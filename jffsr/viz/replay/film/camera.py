"""From where a replay is filmed: a direction in which much of it is seen, and as near as all of it fits for good."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jffsr.viz.replay.film.viewpoint import best_view, moments_of, view_axes
from jffsr.viz.replay.replay import Replay

FIELD = 30.0
"""Vertical angle of view, deg."""
_ELEVATION_FLAT = 60.0  # deg
_SWING, _SWING_FLAT = 7.0, 3.0
"""How far the camera goes to each side of its middle, deg."""
_SIDE, _BELOW, _ABOVE = 0.04, 0.11, 0.13
"""Free edges of a tile, as shares of its width and height; above stands the title, below what the lines are."""


class Camera(NamedTuple):
    """look_at (3,), m, distance, m, and angles, deg; azimuth is the direction seen, 90 along y."""

    look_at: np.ndarray
    distance: float
    azimuth: float
    elevation: float
    swing: float

    def azimuth_at(self, share: float) -> float:
        """The azimuth, deg, after this share [0, 1] of the film: it turns once across, slow at both ends."""
        return self.azimuth - self.swing * np.cos(np.pi * share)

    def pixel(self, height: int) -> float:
        """How large a pixel of a tile of this height is at the point looked at, m."""
        return 2.0 * self.distance * np.tan(np.deg2rad(0.5 * FIELD)) / height


def cameras_for(replays: Sequence[Replay], aspect: float) -> list[Camera]:
    """The camera of each replay in a tile of this width over height; replays of the same bodies are seen alike."""
    alike: dict[tuple[str, ...], list[Replay]] = {}
    for replay in replays:
        alike.setdefault(_bodies(replay), []).append(replay)
    cameras = {bodies: camera_for(group, aspect) for bodies, group in alike.items()}
    return [cameras[_bodies(replay)] for replay in replays]


def _bodies(replay: Replay) -> tuple[str, ...]:
    return tuple(solid.name for solid in replay.solids)


def camera_for(replays: Sequence[Replay], aspect: float) -> Camera:
    """One camera that sees all of each of these replays."""
    moments = [moment for replay in replays for moment in moments_of(replay)]
    blocks = [block for moment in moments for block in moment.blocks]
    points = np.concatenate(blocks + [line for replay in replays for line in _lines(replay)])
    points = points[np.isfinite(points).all(axis=1)]
    flat = all(is_flat(replay) for replay in replays)
    swing = _SWING_FLAT if flat else _SWING
    azimuth, elevation = (90.0, _ELEVATION_FLAT) if flat else best_view(moments)
    look_at, _ = _fitted(points, azimuth, elevation, aspect)
    turns = azimuth + swing * np.linspace(-1.0, 1.0, 5)
    distance = max(_distance(points - look_at, turn, elevation, aspect) for turn in turns)
    return Camera(look_at, distance, azimuth, elevation, swing)


def is_flat(replay: Replay) -> bool:
    """Whether nothing leaves its height or tilts: a motion in the x-y plane."""
    low, high = replay.extent()
    tolerance = 1e-6 * float((high - low).max(initial=1e-12))
    level = all(np.ptp(solid.position[:, 2]) <= tolerance for solid in replay.solids)
    tilts = (np.ptp(_upright(solid.quaternion), axis=0).max() for solid in replay.solids)
    return bool(replay.solids) and level and all(tilt <= 1e-6 for tilt in tilts)


def _upright(quaternion: np.ndarray) -> np.ndarray:
    """The third axes (F, 3) of frames turned by quaternions (F, 4)."""
    w, x, y, z = quaternion.T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)


def _lines(replay: Replay) -> list[np.ndarray]:
    """Points (p, 3) that ways, arrows and axes go to."""
    found = [way.points for way in replay.ways]
    found += [
        axes.position + axes.length * side for axes in replay.axes for side in (-np.ones(3), np.ones(3))
    ]
    return found + [end for arrow in replay.arrows for end in (arrow.origin, arrow.origin + arrow.vector)]


def _slopes(aspect: float) -> tuple[float, float, float]:
    """How far to the side, up and down of its axis a camera's free window reaches, per metre from it."""
    half = np.tan(np.deg2rad(0.5 * FIELD))
    return half * aspect * (1 - 2 * _SIDE), half * (1 - 2 * _ABOVE), half * (1 - 2 * _BELOW)


def _needs(points: np.ndarray, azimuth: float, elevation: float, aspect: float) -> np.ndarray:
    """What bounds the camera (4,): the largest of (offset + slope times depth) to the right, left, up and down."""
    x, y, z = view_axes(azimuth, elevation) @ points.T
    side, up, down = _slopes(aspect)
    return np.array([(x + side * z).max(), (side * z - x).max(), (y + up * z).max(), (down * z - y).max()])


def _fitted(points: np.ndarray, azimuth: float, elevation: float, aspect: float) -> tuple[np.ndarray, float]:
    """The point looked at and the distance from which all points just fit into the free window, centred."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    side, up, down = _slopes(aspect)
    right, left, above, below = _needs(points - middle, azimuth, elevation, aspect)
    # A point at depth z fits at distance d where |x - shift| <= slope (d - z): two bounds on d for either way.
    distance = max((right + left) / (2 * side), (above + below) / (up + down))
    shift = np.array([0.5 * (right - left), 0.5 * ((above - up * distance) + (down * distance - below)), 0.0])
    return middle + shift @ view_axes(azimuth, elevation), distance


def _distance(seen: np.ndarray, azimuth: float, elevation: float, aspect: float) -> float:
    """From how far points about the point looked at fit into the free window."""
    side, up, down = _slopes(aspect)
    return float((_needs(seen, azimuth, elevation, aspect) / np.array([side, side, up, down])).max())
