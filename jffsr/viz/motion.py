"""The robot at several instants of a run, in the inertial frame: light at first, dark at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from jffsr.robots.robot import Robot
from jffsr.viz.scene import Scene, scene_of
from jffsr.viz.style import COLOURS, WIDTH, legend_above, new_figure, styled
from jffsr.viz.view import fill, frame_plane, frame_space, viewpoint

if TYPE_CHECKING:
    from xarray import Dataset

_LIGHT, _DARK = np.array([0.72, 0.82, 0.92]), np.array([0.02, 0.10, 0.25])
_TALLEST = 3.6  # in
_PATH = {"color": COLOURS[2], "linewidth": 0.9, "linestyle": (0, (3, 1))}


@styled
def draw_robot(robot: Robot, dataset: Dataset, instants: int = 5) -> Figure:
    """The robot at `instants` equally spaced samples of a run, with the path of every tool.

    dataset is a run's result.nc. The base is drawn as the uniform box of its mass and inertia with
    the axes of B at the end, the links as lines between joints. A motion in the x-y plane is drawn
    from above, any other in three dimensions, from where the arm spreads widest; all axes have one scale.
    """
    scene = scene_of(robot, dataset)
    chosen = np.unique(np.linspace(0, len(scene.time) - 1, instants).round().astype(int))
    fades = np.linspace(0.0, 1.0, len(chosen)) if len(chosen) > 1 else np.ones(1)
    colours = [tuple(_LIGHT + fade * (_DARK - _LIGHT)) for fade in fades]
    low, high = _extent(scene, chosen)
    if scene.planar:
        size, towards = 2, np.array([0.0, 0.0, 1.0])
        height = float(np.clip((WIDTH - 0.6) * (high - low)[1] / (high - low)[0], 0.9, 3.4)) + 0.75
        figure = new_figure(height)
        axes = figure.subplots()
        frame_plane(axes, low, high)
    else:
        size = 3
        figure = new_figure(WIDTH)
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        azimuth = viewpoint(scene.segments[chosen], scene.base_position[0])
        towards = frame_space(axes, low, high, azimuth)
    for order, (sample, colour) in enumerate(zip(chosen, colours, strict=True)):
        last = order == len(chosen) - 1
        # In space the bases between would only be a tangle of lines.
        if size == 2 or order == 0 or last:
            _draw_base(axes, scene, sample, colour, towards, 10 * order, size, last)
        _draw_arm(axes, scene, sample, colour, 10 * order + 5, size, last)
    for path in np.swapaxes(scene.tools, 0, 1):
        axes.plot(*path.T[:size], **_PATH, zorder=10 * len(chosen))
    _draw_base_axes(axes, scene, 10 * len(chosen) + 1, size)
    handles = [Line2D([], [], color=colour, marker="o", markersize=2.5) for colour in colours]
    handles.append(Line2D([], [], **_PATH))
    times = [f"{scene.time[sample]:.3g}" for sample in chosen]
    legend = legend_above(figure, handles, [*times[:-1], f"{times[-1]} s", "tool path"], handlelength=1.5)
    if size == 3:
        fill(figure, axes, legend, _TALLEST)
    return figure


def _extent(scene: Scene, chosen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate(
        [
            part.reshape(-1, 3)
            for part in (scene.base_faces[chosen], scene.segments[chosen], scene.tools, _base_axes(scene))
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    pad = 0.03 * (high - low).max()
    return low - pad, high + pad


def _draw_base(
    axes, scene: Scene, sample: int, colour, towards: np.ndarray, order: int, size: int, last: bool
) -> None:
    """The faces of the base that look at the reader; the rest of a box is hidden behind them."""
    faces = scene.base_faces[sample]
    outward = faces.mean(axis=1) - scene.base_position[sample]
    faces = faces[outward @ towards > 1e-9 * np.linalg.norm(outward, axis=1)][..., :size]
    collection = Poly3DCollection if size == 3 else PolyCollection
    box = collection(
        faces, facecolors=(*colour, 0.06) if last else "none", edgecolors=colour, linewidths=0.6, zorder=order
    )
    (axes.add_collection3d if size == 3 else axes.add_collection)(box)


def _draw_arm(axes, scene: Scene, sample: int, colour, order: int, size: int, last: bool) -> None:
    width = 1.8 if last else 1.3
    for segment in scene.segments[sample]:
        axes.plot(*segment.T[:size], color=colour, linewidth=width, solid_capstyle="round", zorder=order)
    style = {"color": colour, "linestyle": "none", "marker": "o"}
    axes.plot(*scene.joints[sample].T[:size], **style, markersize=3 if last else 2.2, zorder=order + 1)


def _base_axes(scene: Scene) -> np.ndarray:
    """Ends (3, 3) of the axes of B at the end of the run."""
    faces = scene.base_faces[-1]
    length = 0.85 * np.linalg.norm(faces - scene.base_position[-1], axis=-1).max()
    return scene.base_position[-1] + length * scene.base_rotation[-1].T


def _draw_base_axes(axes, scene: Scene, order: int, size: int) -> None:
    centre = scene.base_position[-1]
    for name, end in zip("xyz"[:size], _base_axes(scene), strict=False):
        line = np.stack([centre, end])
        axes.plot(*line.T[:size], color=COLOURS[3], linewidth=0.8, zorder=order)
        axes.text(
            *(centre + 1.12 * (end - centre))[:size],
            name,
            fontsize=6.5,
            color=COLOURS[3],
            ha="center",
            va="center",
            zorder=order,
        )
