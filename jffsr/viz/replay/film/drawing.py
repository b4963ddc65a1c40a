"""Pictures of replays by MuJoCo, in a process of its own: `python -m jffsr.viz.replay.film.drawing`.

OpenGL's library is chosen for a whole process, before anything of it is loaded, and its drivers may end the process:
neither should happen to the caller's. What is to be drawn comes in by stdin, pictures go out by stdout, and what went
wrong by stderr.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from typing import NamedTuple

import numpy as np

from jffsr.viz.replay.film.between import mixed, near, place_at, turned
from jffsr.viz.replay.film.camera import Camera, cameras_for
from jffsr.viz.replay.film.sky import BELOW
from jffsr.viz.replay.film.tiles import Tile
from jffsr.viz.replay.replay import Replay
from jffsr.viz.replay.shading import warned

READY = b"ready\n"


class Task(NamedTuple):
    """Replays, the tile of each, the picture's width and height, and the instants (K,), s, to draw them at."""

    replays: Sequence[Replay]
    tiles: Sequence[Tile]
    width: int
    height: int
    times: np.ndarray


class _Stage:
    """One replay, ready to be drawn into its tile."""

    def __init__(self, replay: Replay, camera: Camera, tile: Tile, height: int):
        import mujoco

        from jffsr.viz.replay.film.model import film_model
        from jffsr.viz.replay.film.strokes import Strokes, most_strokes

        self._replay, self._camera = replay, camera
        self._model = film_model(replay, self._camera, tile.width, tile.height)
        self._data = mujoco.MjData(self._model)
        # In a small tile lines are thinner, but not in proportion.
        scale = 0.5 * (height + tile.height) / 720
        self._strokes = Strokes(replay, scale * self._camera.pixel(tile.height))
        self._scene = mujoco.MjvScene(self._model, maxgeom=len(replay.solids) + most_strokes(replay) + 20)
        self._options, self._view = mujoco.MjvOption(), mujoco.MjvCamera()
        self._view.lookat, self._view.distance = self._camera.look_at, self._camera.distance
        self._view.elevation = -self._camera.elevation
        self._context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        self._window = mujoco.MjrRect(0, 0, tile.width, tile.height)
        self._pixels = np.empty((tile.height, tile.width, 3), np.uint8)

    def picture(self, instant: float, share: float) -> np.ndarray:
        """The picture (h, w, 3) at an instant, s, after a share of the film."""
        import mujoco

        place = place_at(self._replay.time, instant)
        for number, solid in enumerate(self._replay.solids):
            self._data.mocap_pos[number] = mixed(solid.position, place)
            self._data.mocap_quat[number] = turned(solid.quaternion, place)
            self._model.geom_rgba[number, :3] = warned(solid.colour, near(solid.nearness, place))
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._view.azimuth = self._camera.azimuth_at(share)
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            self._options,
            None,
            self._view,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        self._strokes.add(self._scene, place)
        # Each stage has a buffer of its own, of which one is drawn to.
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        mujoco.mjr_render(self._window, self._scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._window, self._context)
        return self._pixels[::-1]


def pictures(task: Task) -> Iterator[np.ndarray]:
    """The pictures (height, width, 3) one after another; the current thread needs an OpenGL context."""
    cameras = cameras_for(task.replays, task.tiles[0].width / task.tiles[0].height)
    stages = [
        _Stage(replay, camera, tile, task.height)
        for replay, camera, tile in zip(task.replays, cameras, task.tiles, strict=True)
    ]
    whole = np.empty((task.height, task.width, 3), np.uint8)
    whole[:] = BELOW.astype(np.uint8)
    for number, instant in enumerate(task.times):
        share = number / max(len(task.times) - 1, 1)
        for stage, tile in zip(stages, task.tiles, strict=True):
            part = whole[tile.top : tile.top + tile.height, tile.left : tile.left + tile.width]
            part[:] = stage.picture(float(instant), share)
        yield whole


def _context(name: str, width: int, height: int):
    """A current OpenGL context of the library `name`, of those that MUJOCO_GL may be."""
    module = f"mujoco.{name}" if name in ("egl", "osmesa", "glfw", "cgl") else "mujoco.gl_context"
    context = import_module(module).GLContext(width, height)
    context.make_current()
    return context


def main() -> None:
    """Draw the task on stdin to stdout."""
    out = os.fdopen(os.dup(1), "wb")
    # Drivers talk.
    os.dup2(2, 1)
    task: Task = pickle.load(sys.stdin.buffer)
    context = _context(os.environ.get("MUJOCO_GL", ""), task.width, task.height)
    for number, picture in enumerate(pictures(task)):
        if number == 0:
            out.write(READY)
        out.write(picture.tobytes())
    out.flush()
    del context


if __name__ == "__main__":
    status = 1
    try:
        main()
        status = 0
    except BrokenPipeError:
        pass  # the caller has seen enough
    except Exception as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
    # Some of OpenGL's libraries fail while an interpreter ends.
    sys.stderr.flush()
    os._exit(status)
