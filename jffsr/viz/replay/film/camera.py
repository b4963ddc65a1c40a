"""From where a replay is filmed: a direction in which much of it is seen, and as near as all of it fits for good."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jffsr.viz.replay.film.between import Place, turned
from jffsr.viz.replay.replay import Replay

FIELD = 30.0
"""Vertical angle of view, deg."""
_ELEVATION, _ELEVATION_FLAT = 22.0, 55.0  # deg
_SWING, _SWING_FLAT = 7.0, 3.0
"""How far the camera goes to each side of its middle, deg."""
_SIDE, _BELOW, _ABOVE = 0.04, 0.11, 0.13
"""Free edges of a tile, as shares of its width and height; above stands the title, below what the lines are."""
_SAMPLES, _CORNERS = 25, 40


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


def camera_for(replay: Replay, aspect: float) -> Camera:
    """The camera of a replay in a tile of this width over height."""
    points, centres = _points(replay)
    flat = is_flat(replay)
    elevation, swing = (_ELEVATION_FLAT, _SWING_FLAT) if flat else (_ELEVATION, _SWING)
    azimuth = 90.0 if flat else _best_azimuth(centres, elevation)
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


def _points(replay: Replay) -> tuple[np.ndarray, np.ndarray]:
    """Points (p, 3) that hold all that is drawn at some instants, and where bodies and ends of arrows are (c, 3)."""
    chosen = np.unique(np.linspace(0, replay.frames - 1, _SAMPLES).round().astype(int))
    found, centres = [], [way.points for way in replay.ways]
    for solid in replay.solids:
        corners = _corners(solid.vertices)
        for frame in chosen:
            turn = _rotation(turned(solid.quaternion, Place(int(frame), 0.0)))
            found.append(corners @ turn.T + solid.position[frame])
        centres.append(np.array([block.mean(axis=0) for block in found[-len(chosen) :]]))
    for arrow in replay.arrows:
        found += [arrow.origin, arrow.origin + arrow.vector]
    found += [way.points for way in replay.ways]
    found += [axes.position for axes in replay.axes]
    points = np.concatenate(found) if found else np.zeros((1, 3))
    points = points[np.isfinite(points).all(axis=1)]
    return points, np.concatenate(centres) if centres else points


def _corners(vertices: np.ndarray) -> np.ndarray:
    """Those of the vertices that are outermost in some direction: enough to know how much room a body takes."""
    if len(vertices) <= _CORNERS:
        return vertices
    golden = np.pi * (1.0 + 5.0**0.5)
    number = np.arange(_CORNERS) + 0.5
    polar = np.arccos(1 - 2 * number / _CORNERS)
    directions = np.stack(
        [np.cos(golden * number) * np.sin(polar), np.sin(golden * number) * np.sin(polar), np.cos(polar)],
        axis=1,
    )
    return vertices[np.unique(np.argmax(vertices @ directions.T, axis=0))]


def _rotation(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def view_axes(azimuth: float, elevation: float) -> np.ndarray:
    """Rows (3, 3): to the right and up in the picture, and from what is seen to the camera."""
    a, e = np.deg2rad(azimuth), np.deg2rad(elevation)
    towards = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), -np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def _best_azimuth(centres: np.ndarray, elevation: float) -> float:
    """Where bodies and ways cover most of the picture; never along an axis, where a box shows one side."""
    spread = centres - centres.mean(axis=0)
    choices = [quarter + turn for quarter in (0, 90, 180, 270) for turn in (30, 55)]

    def area(azimuth: float) -> float:
        seen = spread @ view_axes(azimuth, elevation)[:2].T
        return float(np.prod(np.linalg.svd(seen, compute_uv=False)[:2]))

    return float(max(choices, key=area))


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
