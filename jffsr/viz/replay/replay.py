"""A motion ready to be shown: solids that move, ways, arrows and curves, with nothing of a viewer in it.

All positions are in I, in m; F is the number of frames, which all arrays of a replay share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError


class NothingMoved(InputError):
    """A run without a motion, such as a search that found no plan."""


Colour = tuple[float, float, float]
"""Red, green and blue in [0, 1]."""


@dataclass(frozen=True)
class Solid:
    """A rigid body as triangles.

    vertices (v, 3), m, and faces (f, 3), indices of them, counter-clockwise seen from outside, in the body's own frame;
    position (F, 3) and quaternion (F, 4), w first, of that frame. nearness (F,) says how near a limit the body is: 0
    far, 1 at the limit, more beyond it; None where it has none.
    """

    name: str
    vertices: np.ndarray
    faces: np.ndarray
    colour: Colour
    position: np.ndarray
    quaternion: np.ndarray
    nearness: np.ndarray | None = None


@dataclass(frozen=True)
class Way:
    """A line of points (F, 3) along which something goes; `ahead` says that the whole of it is known beforehand."""

    name: str
    points: np.ndarray
    colour: Colour
    ahead: bool = False


@dataclass(frozen=True)
class Arrow:
    """A vector at a place: origin (F, 3), m, and vector (F, 3) as long as it is drawn, m.

    One metre of it stands for `scale` of its unit.
    """

    name: str
    origin: np.ndarray
    vector: np.ndarray
    colour: Colour
    scale: float = 1.0


@dataclass(frozen=True)
class Axes:
    """A frame drawn by its three axes of `length`, m: position (F, 3), quaternion (F, 4), w first."""

    name: str
    position: np.ndarray
    quaternion: np.ndarray
    length: float


@dataclass(frozen=True)
class Panel:
    """A plot beside the replay: curves by name over time (k,), s, all with one unit; bounds are lines across it."""

    title: str
    unit: str
    time: np.ndarray
    curves: dict[str, np.ndarray]
    bounds: tuple[float, ...] = ()
    logarithmic: bool = False


@dataclass(frozen=True)
class Replay:
    """One motion to look at.

    time (F,), s; marks are instants worth a line in the plots, by name; legend explains what is drawn, in one sentence
    each.
    """

    title: str
    time: np.ndarray
    solids: tuple[Solid, ...]
    ways: tuple[Way, ...] = ()
    arrows: tuple[Arrow, ...] = ()
    axes: tuple[Axes, ...] = ()
    panels: tuple[Panel, ...] = ()
    marks: tuple[tuple[str, float], ...] = ()
    legend: tuple[str, ...] = ()

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.time)

    @cached_property
    def points(self) -> np.ndarray:
        """Points (k, 3), m, whose hull holds everything at all frames: corners of the solids' boxes, and all lines."""
        found = [way.points for way in self.ways] + [arrow.origin + arrow.vector for arrow in self.arrows]
        for solid in self.solids:
            least, most = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
            corners = np.array(list(product(*zip(least, most, strict=True))))
            turned = Rotation.from_quat(solid.quaternion, scalar_first=True).as_matrix() @ corners.T
            found.append((np.swapaxes(turned, -1, -2) + solid.position[:, None]).reshape(-1, 3))
        return np.concatenate(found)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners (3,), m, of the box that holds everything at all frames."""
        return self.points.min(axis=0), self.points.max(axis=0)

    def named(self, title: str) -> Replay:
        """The same under another title."""
        return replace(self, title=title)
