"""The robot at several instants of a run, in the inertial frame: light at first, dark at the end."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from jffsr.robots.robot import Robot
from jffsr.viz.scene import Scene, scene_of
from jffsr.viz.style import COLOURS, WIDTH, legend_above, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_LIGHT, _DARK = np.array([0.72, 0.82, 0.92]), np.array([0.02, 0.10, 0.25])


@styled
def draw_robot(robot: Robot, dataset: Dataset, instants: int = 5) -> Figure:
    """The robot at `instants` equally spaced samples of a run, with the path of every tool.

    dataset is a run's result.nc. The base is drawn as the uniform box of its mass and inertia with the axes of
    B at the end, the links as lines between joints. A motion in the x-y plane is drawn from above, any other
    in three dimensions, from where the arm spreads widest; all axes have one scale.
    """
    scene = scene_of(robot, dataset)
    chosen = np.unique(np.linspace(0, len(scene.time) - 1, instants).round().astype(int))
    fades = np.linspace(0.0, 1.0, len(chosen)) if len(chosen) > 1 else np.ones(1)
    colours = [tuple(_LIGHT + fade * (_DARK - _LIGHT)) for fade in fades]
    low, high = _extent(scene, chosen)
    if scene.planar:
        size = 2
        height = float(np.clip((WIDTH - 0.6) * (high - low)[1] / (high - low)[0], 0.9, 3.4)) + 0.75
        figure = new_figure(height)
        axes = figure.subplots()
        _frame_plane(axes, low, high)
    else:
        size = 3
        figure = new_figure(3.3)
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        _frame_space(axes, low, high, *_viewpoint(scene, chosen))
    for order, (sample, colour) in enumerate(zip(chosen, colours, strict=True)):
        _draw_instant(axes, scene, sample, colour, 10 + 10 * order, size, last=order == len(chosen) - 1)
    for path in np.swapaxes(scene.tools, 0, 1):
        axes.plot(*path.T[:size], color=COLOURS[2], linewidth=0.9, zorder=100)
    _draw_base_axes(axes, scene, 101, size)
    handles = [Line2D([], [], color=colour, marker="o", markersize=2.5) for colour in colours]
    handles.append(Line2D([], [], color=COLOURS[2], linewidth=0.9))
    times = [f"{scene.time[sample]:g}" for sample in chosen]
    legend_above(figure, handles, [*times[:-1], f"{times[-1]} s", "tool path"])
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


def _draw_instant(axes, scene: Scene, sample: int, colour, order: int, size: int, last: bool) -> None:
    faces = scene.base_faces[sample][..., :size]
    collection = Poly3DCollection if size == 3 else PolyCollection
    box = collection(
        faces,
        facecolors=(*colour, 0.06) if last else "none",
        edgecolors=colour,
        linewidths=0.7 if last else 0.5,
        zorder=order,
    )
    (axes.add_collection3d if size == 3 else axes.add_collection)(box)
    width = 1.8 if last else 1.3
    for segment in scene.segments[sample]:
        axes.plot(*segment.T[:size], color=colour, linewidth=width, solid_capstyle="round", zorder=order + 1)
    style = {"color": colour, "linestyle": "none", "marker": "o"}
    axes.plot(*scene.joints[sample].T[:size], **style, markersize=3 if last else 2.2, zorder=order + 2)


def _base_axes(scene: Scene) -> np.ndarray:
    """Ends (3, 3) of the axes of B at the end of the run."""
    faces = scene.base_faces[-1]
    length = 0.75 * np.linalg.norm(faces - scene.base_position[-1], axis=-1).max()
    return scene.base_position[-1] + length * scene.base_rotation[-1].T


def _draw_base_axes(axes, scene: Scene, order: int, size: int) -> None:
    centre = scene.base_position[-1]
    for name, end in zip("xyz"[:size], _base_axes(scene), strict=False):
        line = np.stack([centre, end])
        axes.plot(*line.T[:size], color=COLOURS[3], linewidth=0.8, zorder=order)
        axes.text(*(centre + 1.12 * (end - centre))[:size], name, fontsize=6.5, color=COLOURS[3],
                  ha="center", va="center", zorder=order)


def _frame_plane(axes, low: np.ndarray, high: np.ndarray) -> None:
    axes.set_aspect("equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")


def _frame_space(axes, low: np.ndarray, high: np.ndarray, elevation: float, azimuth: float) -> None:
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.set_proj_type("ortho")
    axes.view_init(elev=elevation, azim=azimuth)
    longest = (high - low).max()
    for name, axis, span in zip("xyz", (axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(MaxNLocator(max(1, round(4 * span / longest)), steps=[1, 2, 5, 10]))
        axis.set_pane_color((1, 1, 1, 0))
        axis.set_tick_params(pad=-3)
        axis.set_label_text(f"{name} [m]")
        axis.labelpad = -8
        axis._axinfo["grid"].update(color="0.9", linewidth=0.4)


def _viewpoint(scene: Scene, chosen: np.ndarray) -> tuple[float, float]:
    """Elevation and azimuth, deg, from where the arm's places cover most of the picture, before the base."""
    arm = scene.segments[chosen].reshape(-1, 3) - scene.base_position[0]
    spread = arm - arm.mean(axis=0)

    def merit(view: tuple[float, float]) -> float:
        e, a = np.deg2rad(view)
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        across = spread @ np.stack([right, np.cross(towards, right)], axis=1)
        area = np.prod(np.linalg.svd(across, compute_uv=False))
        return float(area) * (2.0 + np.tanh(arm.mean(axis=0) @ towards))

    return max(product((20.0, -20.0), range(-165, 180, 15)), key=merit)
