"""Ways, arrows and axes of a replay as shapes in a MuJoCo scene, as wide as a few pixels from any distance."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np

from jffsr.viz.replay.film.between import Place, mixed, turned
from jffsr.viz.replay.film.sky import paled
from jffsr.viz.replay.replay import Axes, Colour, Replay, Way

_PIECES = 220
_WIDE, _NARROW, _AXIS = 1.7, 1.1, 1.6
"""Half widths, pixels in a picture 720 high."""
_HEAD = (17.0, 5.5)
"""Length and half width of an arrow's head, pixels."""
_DISCS = 10
_AXES_COLOURS = ((0.90, 0.27, 0.24), (0.35, 0.78, 0.36), (0.30, 0.55, 0.96))
_GLOW = 0.35


class Strokes:
    """What is drawn as lines: made once, added to the scene at every picture."""

    def __init__(self, replay: Replay, pixel: float):
        self._replay, self._pixel = replay, pixel
        self._corners = [way_corners(way.points) for way in replay.ways]

    def add(self, scene: mujoco.MjvScene, place: Place) -> None:
        """Add everything that is to be seen at a place among the replay's frames."""
        for way, corners in zip(self._replay.ways, self._corners, strict=True):
            self._add_way(scene, way, corners, place)
        for arrow in self._replay.arrows:
            self._add_arrow(scene, mixed(arrow.origin, place), mixed(arrow.vector, place), arrow.colour)
        for axes in self._replay.axes:
            self._add_axes(scene, axes, place)

    def _add_way(self, scene, way: Way, corners: np.ndarray, place: Place) -> None:
        now = mixed(way.points, place)
        if way.ahead:
            self._add_line(scene, way.points[corners], _NARROW, paled(way.colour))
            self._add(scene, mujoco.mjtGeom.mjGEOM_SPHERE, 1.8 * _WIDE, now, now, way.colour)
        else:
            been = way.points[corners[corners <= place.index]]
            self._add_line(scene, np.concatenate([been, now[None]]), _WIDE, way.colour)

    def _add_line(self, scene, points: np.ndarray, width: float, colour: Colour) -> None:
        for start, end in pairwise(points):
            self._add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, width, start, end, colour)

    def _add_arrow(self, scene, origin: np.ndarray, vector: np.ndarray, colour: Colour) -> None:
        length = np.linalg.norm(vector)
        if not length > 2 * self._pixel:
            return
        head = min(_HEAD[0] * self._pixel, 0.5 * length) / length
        self._add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, _WIDE, origin, origin + (1 - head) * vector, colour)
        # MuJoCo's own arrows are not of the length given in all of its versions: a cone is made of discs.
        steps = np.linspace(0.0, 1.0, _DISCS + 1)
        for near, far in pairwise(steps):
            ends = (origin + (1 - head + head * step) * vector for step in (near, far))
            width = _HEAD[1] * (1 - 0.5 * (near + far))
            self._add(scene, mujoco.mjtGeom.mjGEOM_CYLINDER, width, *ends, colour)

    def _add_axes(self, scene, axes: Axes, place: Place) -> None:
        origin, turn = mixed(axes.position, place), np.empty(9)
        mujoco.mju_quat2Mat(turn, turned(axes.quaternion, place))
        for direction, colour in zip(turn.reshape(3, 3).T, _AXES_COLOURS, strict=True):
            end = origin + axes.length * direction
            self._add(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, _AXIS, origin, end, colour)

    def _add(self, scene, kind, width: float, start: np.ndarray, end: np.ndarray, colour: Colour) -> None:
        if scene.ngeom >= scene.maxgeom or not (np.isfinite(start).all() and np.isfinite(end).all()):
            return
        geom = scene.geoms[scene.ngeom]
        size, turn = np.full(3, width * self._pixel), np.eye(3).ravel()
        mujoco.mjv_initGeom(geom, kind, size, start, turn, np.array([*colour, 1.0], dtype=np.float32))
        if kind != mujoco.mjtGeom.mjGEOM_SPHERE:
            mujoco.mjv_connector(geom, kind, width * self._pixel, start, end)
        # Lines keep their colours in the shade.
        geom.emission, geom.specular = _GLOW, 0.0
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        scene.ngeom += 1


def most_strokes(replay: Replay) -> int:
    """How many shapes a replay needs at most."""
    return (_PIECES + 3) * len(replay.ways) + (_DISCS + 1) * len(replay.arrows) + 3 * len(replay.axes)


def way_corners(points: np.ndarray, pieces: int = _PIECES) -> np.ndarray:
    """Indices of the points (F, 3) of a way that are drawn: no piece is shorter than the whole over `pieces`."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    whole = np.concatenate([[0.0], np.cumsum(np.nan_to_num(lengths))])
    if whole[-1] <= 0.0:
        return np.zeros(1, int)
    bins = np.floor(whole * (pieces / whole[-1])).astype(int)
    first = np.flatnonzero(np.diff(bins, prepend=-1))
    return np.unique(np.append(first, len(points) - 1))
