"""Replays as the scene of a viser server: nodes added once, and moved to any frame."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from jffsr.viz.replay.layout import places, title_place, view_of
from jffsr.viz.replay.replay import Axes, Colour, Replay, Solid, Way
from jffsr.viz.replay.shading import warned

_PIECES = 60
"""Into how many pieces a way is cut, which appear one after the other."""
_PALE: Colour = (0.62, 0.66, 0.72)
_GRID = 2.0**-14
"""Places, as shares of the replay's size, and quaternions are rounded to this: nobody sees it, what moves less is not
sent, and numbers that end in zeros make a page of a fraction of the size."""


class ReplayScene:
    """Replays side by side in a viser scene; `show(time)` moves all of them to an instant.

    server is a viser.ViserServer. Each replay stands in a node of its own, /0, /1, ..., under which ways, arrows and
    axes have nodes of their own that can be hidden.
    """

    def __init__(self, server: Any, replays: Sequence[Replay]):
        self._server, self.replays = server, tuple(replays)
        self._shown: list[int | None] = [None] * len(self.replays)
        self._parts: list[_Parts] = []
        scene = server.scene
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        scene.add_light_ambient("/light", intensity=1.0)
        sizes = [float(np.max(np.subtract(*replay.extent()[::-1]))) for replay in self.replays]
        for number, (replay, place) in enumerate(zip(self.replays, places(self.replays), strict=True)):
            root = f"/{number}"
            scene.add_frame(root, show_axes=False, position=place)
            self._parts.append(_Parts(scene, root, replay, sizes[number]))
            if len(self.replays) > 1:
                scene.add_label(f"{root}/title", replay.title, position=title_place(replay))
        view = view_of(self.replays)
        camera = server.initial_camera
        camera.position, camera.look_at, camera.up, camera.fov = (
            view.position,
            view.look_at,
            view.up,
            view.fov,
        )
        camera.near, camera.far = 1e-3 * max(sizes), 1e3 * max(sizes)
        self.show(0.0)

    def show(self, time: float) -> None:
        """Move every replay to its last frame not after `time`, s."""
        for number, (replay, parts) in enumerate(zip(self.replays, self._parts, strict=True)):
            frame = int(
                np.clip(np.searchsorted(replay.time, time + 1e-9, side="right") - 1, 0, replay.frames - 1)
            )
            if frame != self._shown[number]:
                parts.move(frame)
                self._shown[number] = frame

    def hide(self, kind: str, hidden: bool) -> None:
        """Hide or show again all "ways", "arrows" or "axes"."""
        for parts in self._parts:
            parts.roots[kind].visible = not hidden


class _Parts:
    """The nodes of one replay."""

    def __init__(self, scene: Any, root: str, replay: Replay, size: float):
        self.replay = replay
        self._grid = _GRID * 2.0 ** np.round(np.log2(size))
        self.roots = {
            kind: scene.add_frame(f"{root}/{kind}", show_axes=False) for kind in ("ways", "arrows", "axes")
        }
        # What moves is a frame around each solid: a mesh that takes another colour may miss a move that comes with it.
        self._solids = [
            scene.add_frame(f"{root}/{number} {solid.name}", show_axes=False)
            for number, solid in enumerate(replay.solids)
        ]
        self._meshes = [
            scene.add_mesh_simple(
                f"{root}/{number} {solid.name}/shape",
                np.asarray(solid.vertices, np.float32),
                np.asarray(solid.faces, np.uint32),
                color=_bytes(solid.colour),
            )
            for number, solid in enumerate(replay.solids)
        ]
        self._colours = [solid.colour for solid in replay.solids]
        thickness = 0.004 * size
        self._ways = [
            self._add_way(scene, f"{root}/ways/{number} {way.name}", way, thickness)
            for number, way in enumerate(replay.ways)
        ]
        self._seen = [0] * len(self._ways)
        self._arrows = [
            scene.add_arrows(
                f"{root}/arrows/{number} {arrow.name}",
                _ends(arrow, 0),
                np.array(_bytes(arrow.colour), np.uint8),
                shaft_radius=0.006 * size,
                head_radius=0.014 * size,
                head_length=0.03 * size,
            )
            for number, arrow in enumerate(replay.arrows)
        ]
        self._axes = [
            scene.add_frame(
                f"{root}/axes/{number} {axes.name}",
                axes_length=axes.length,
                axes_radius=0.04 * axes.length,
                position=axes.position[0],
                wxyz=axes.quaternion[0],
            )
            for number, axes in enumerate(replay.axes)
        ]

    def move(self, frame: int) -> None:
        replay = self.replay
        for number, (handle, solid) in enumerate(zip(self._solids, replay.solids, strict=True)):
            self._place(handle, solid, frame)
            if solid.nearness is not None:
                colour = warned(solid.colour, float(solid.nearness[frame]))
                if colour != self._colours[number]:
                    self._meshes[number].color, self._colours[number] = _bytes(colour), colour
        for number, pieces in enumerate(self._ways):
            now = sum(last <= frame for last, _ in pieces)
            before, self._seen[number] = self._seen[number], now
            for _, piece in pieces[min(before, now) : max(before, now)]:
                piece.visible = now > before
        for handle, arrow in zip(self._arrows, replay.arrows, strict=True):
            handle.points = self._grid * np.round(_ends(arrow, frame) / self._grid)
        for handle, axes in zip(self._axes, replay.axes, strict=True):
            self._place(handle, axes, frame)

    def _place(self, handle: Any, thing: Solid | Axes, frame: int) -> None:
        position = self._grid * np.round(thing.position[frame] / self._grid)
        quaternion = _GRID * np.round(thing.quaternion[frame] / _GRID)
        if np.any(handle.position != position):
            handle.position = position
        if np.any(handle.wxyz != quaternion):
            handle.wxyz = quaternion

    def _add_way(self, scene: Any, name: str, way: Way, thickness: float) -> list[tuple[int, Any]]:
        """The pieces of a way, each with the frame at which it is complete; a pale line where it is known ahead."""
        pairs = np.stack([way.points[:-1], way.points[1:]], axis=1).astype(np.float32)
        moving = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) > 0
        if not moving.any():
            return []
        if way.ahead:
            scene.add_line_segments(
                f"{name} ahead", pairs[moving], np.array(_bytes(_PALE), np.uint8), thickness=0.7 * thickness
            )
        bounds = np.unique(np.linspace(0, len(pairs), 1 + min(_PIECES, len(pairs))).astype(int))
        found = []
        for number, (first, last) in enumerate(itertools.pairwise(bounds)):
            chosen = pairs[first:last][moving[first:last]]
            if len(chosen):
                piece = scene.add_line_segments(
                    f"{name}/{number}",
                    chosen,
                    np.array(_bytes(way.colour), np.uint8),
                    thickness=thickness,
                    visible=False,
                )
                found.append((int(last), piece))
        return found


def _ends(arrow, frame: int) -> np.ndarray:
    start = arrow.origin[frame]
    return np.stack([start, start + arrow.vector[frame]])[None].astype(np.float32)


def _bytes(colour: Colour) -> tuple[int, int, int]:
    red, green, blue = (round(255 * part) for part in colour)
    return red, green, blue
