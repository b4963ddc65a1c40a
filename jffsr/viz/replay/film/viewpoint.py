"""From which side a motion is seen best: where much of it is spread out, and little is behind a large body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jffsr.viz.replay.film.between import Place, turned
from jffsr.viz.replay.replay import Replay

_SAMPLES, _CORNERS = 25, 40
_HIDING = 3
"""How many of the largest bodies may hide others."""
_ELEVATIONS = {22.0: 1.0, 42.0: 0.9, -18.0: 0.75}
"""Heights of the camera that are tried, deg, and how much each is liked."""
# Never along an axis, where a box shows one side.
_AZIMUTHS = [quarter + turn for quarter in (0.0, 90.0, 180.0, 270.0) for turn in (30.0, 60.0)]


class Moment(NamedTuple):
    """One instant: points (c, 3) in I of every body, then of every way, and how each body is placed and turned in I."""

    blocks: tuple[np.ndarray, ...]
    positions: np.ndarray
    rotations: np.ndarray
    boxes: np.ndarray
    """Corners (s, 2, 3) of each body's box in its own frame."""


def moments_of(replay: Replay) -> list[Moment]:
    """Some instants of a replay, its first and last among them."""
    corners = [_corners(solid.vertices) for solid in replay.solids]
    boxes = np.array([(c.min(axis=0), c.max(axis=0)) if len(c) else np.zeros((2, 3)) for c in corners])
    ways = [
        way.points[np.isfinite(way.points).all(axis=1)][:: max(replay.frames // 20, 1)] for way in replay.ways
    ]
    found = []
    for frame in np.unique(np.linspace(0, replay.frames - 1, _SAMPLES).round().astype(int)):
        place = Place(int(frame), 0.0)
        rotations = np.array([_rotation(turned(solid.quaternion, place)) for solid in replay.solids])
        positions = np.array([solid.position[frame] for solid in replay.solids])
        blocks = [c @ r.T + p for c, r, p in zip(corners, rotations, positions, strict=True)]
        found.append(Moment((*blocks, *ways), positions, rotations, boxes))
    return found


def view_axes(azimuth: float, elevation: float) -> np.ndarray:
    """Rows (3, 3): to the right and up in the picture, and from what is seen to the camera; angles in deg."""
    a, e = np.deg2rad(azimuth), np.deg2rad(elevation)
    towards = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), -np.sin(e)])
    right = np.array([np.sin(a), -np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def best_view(moments: Sequence[Moment]) -> tuple[float, float]:
    """Azimuth and elevation, deg, from where the bodies are spread out and seen."""
    middles = np.concatenate([[block.mean(axis=0) for block in m.blocks if len(block)] for m in moments])
    spread = middles - middles.mean(axis=0)

    def merit(view: tuple[float, float]) -> float:
        axes = view_axes(*view)
        area = np.prod(np.linalg.svd(spread @ axes[:2].T, compute_uv=False)[:2])
        seen = np.mean([_seen(moment, axes[2]) for moment in moments[::4]])
        return float(np.sqrt(area) * seen * _ELEVATIONS[view[1]])

    return max(((azimuth, elevation) for elevation in _ELEVATIONS for azimuth in _AZIMUTHS), key=merit)


def _seen(moment: Moment, towards: np.ndarray) -> float:
    """The share of points that no large body's box hides from `towards`, its mean over all bodies and ways."""
    order = np.argsort(-np.prod(moment.boxes[:, 1] - moment.boxes[:, 0], axis=1))[:_HIDING]
    shares = []
    for number, block in enumerate(moment.blocks):
        if not len(block):
            continue
        free = np.ones(len(block), bool)
        for other in order:
            if other != number:
                free &= ~_hidden(block, towards, moment, int(other))
        shares.append(free.mean())
    return float(np.mean(shares)) if shares else 1.0


def _hidden(points: np.ndarray, towards: np.ndarray, moment: Moment, body: int) -> np.ndarray:
    """Which of the points (p, 3) have the body's box between them and the camera, or are in it."""
    start = (points - moment.positions[body]) @ moment.rotations[body]
    direction = towards @ moment.rotations[body]
    with np.errstate(divide="ignore", invalid="ignore"):
        # Where the ray enters and leaves each pair of sides.
        low, high = ((side - start) / direction for side in moment.boxes[body])
    enter, leave = np.fmin(low, high).max(axis=1), np.fmax(low, high).min(axis=1)
    return (leave > 0) & (enter < leave)


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
