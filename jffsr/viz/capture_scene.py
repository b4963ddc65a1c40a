"""Robot and target of a capture in space: at the start, half way, and at the grasp."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from scipy.spatial.transform import Rotation

from jffsr.robots.geometry import MESH, VISUAL, Geometry
from jffsr.robots.robot import Robot
from jffsr.viz.robot import draw_solids, solids_of
from jffsr.viz.scene import scene_of
from jffsr.viz.solids import shape_faces
from jffsr.viz.style import COLOURS, legend_above, new_figure, styled
from jffsr.viz.view import frame_plane, frame_space, viewpoint

if TYPE_CHECKING:
    from xarray import Dataset

_WIDTH = 7.2  # in
_TARGET = (0.93, 0.77, 0.55, 1.0)
_TOOL = {"color": COLOURS[2], "linewidth": 1.0, "linestyle": (0, (3, 1))}
_POINT = {"color": COLOURS[0], "linewidth": 1.0}
_FRAME = (COLOURS[2], COLOURS[3], COLOURS[1])
_PANEL = 1.85
"""in, the width of a picture in a plane."""
_AXIS = 0.12  # of the picture, the axes of the grasp frame


@styled
def draw_capture(robot: Robot, geometry: Geometry, dataset: Dataset) -> Figure:
    """Three pictures of a capture's result.nc side by side, with the ways of tool and grasp point so far.

    The robot as in `draw_still`, the target by the shapes of `geometry`, and the grasp frame's axes. A motion in the
    x-y plane is drawn from above.
    """
    scene = scene_of(robot, dataset)
    last = len(scene.time) - 1
    chosen = (0, last // 2, last)
    place = dataset["target_position"].values
    turn = Rotation.from_quat(dataset["target_quaternion"].values, scalar_first=True).as_matrix()
    all_solids = [
        [*solids_of(robot, scene, sample), *_target(geometry, place[sample], turn[sample])]
        for sample in chosen
    ]
    low, high = _extent(all_solids, dataset)
    planar = scene.planar
    size = 2 if planar else 3
    span = high - low
    height = 0.85 + float(np.clip(_PANEL * span[1] / span[0], 0.8, 2.4)) if planar else 2.75
    figure = new_figure(height, _WIDTH)
    axes = figure.subplots(1, 3, subplot_kw={} if planar else {"projection": "3d", "computed_zorder": False})
    azimuth = viewpoint(scene.segments[list(chosen)], scene.base_position[0])
    for panel, sample, solids in zip(axes, chosen, all_solids, strict=True):
        if planar:
            towards = np.array([0.0, 0.0, 1.0])
            frame_plane(panel, low, high)
        else:
            towards = frame_space(panel, low, high, azimuth, labelpad=-7)
            _few_numbers(panel, high - low)
        draw_solids(panel, solids, towards, 0.03 * (high - low).max(), size)
        _draw_ways(panel, dataset, sample, size)
        _draw_frame(panel, dataset, sample, _AXIS * (high - low).max(), size)
        panel.set_title(f"{scene.time[sample]:.3g} s")
    handles = [Line2D([], [], **_TOOL), Line2D([], [], **_POINT)]
    handles += [Line2D([], [], color=colour, linewidth=1.3) for colour in _FRAME[:size]]
    labels = ["tool's way", "grasp point's way", "grasp frame x", "y", "z"][: 2 + size]
    legend_above(figure, handles, labels)
    return figure


def _few_numbers(panel, spans: np.ndarray) -> None:
    """Of a small picture: an axis has as many numbers as there is room for, the shortest hardly any."""
    panel.set_box_aspect(spans, zoom=1.03)
    for axis, share in zip((panel.xaxis, panel.yaxis, panel.zaxis), spans / spans.max(), strict=True):
        axis.set_major_locator(MaxNLocator(max(1, round(3 * share - 1)), steps=[1, 2, 5, 10]))
        axis.set_tick_params(labelsize=6)


def _target(geometry: Geometry, place: np.ndarray, turn: np.ndarray) -> list[tuple]:
    shapes = [shape for shape in geometry.shapes if VISUAL in shape.roles] or list(geometry.shapes)
    return [
        (shape_faces(shape) @ turn.T + place, shape.colour or _TARGET, shape.kind != MESH, False)
        for shape in shapes
    ]


def _extent(all_solids: list, dataset: Dataset) -> tuple[np.ndarray, np.ndarray]:
    points = [faces.reshape(-1, 3) for solids in all_solids for faces, *_ in solids]
    points += [dataset["tool_position"].values, dataset["grasp_position"].values]
    points.append(dataset["grasp_position"].values[-1] + [[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]])
    points = np.concatenate(points)
    low, high = points.min(axis=0), points.max(axis=0)
    pad = 0.03 * (high - low).max()
    return low - pad, high + pad


def _draw_ways(panel, dataset: Dataset, sample: int, size: int) -> None:
    for name, look in (("grasp_position", _POINT), ("tool_position", _TOOL)):
        way = dataset[name].values[: sample + 1]
        panel.plot(*way.T[:size], **look, zorder=6)


def _draw_frame(panel, dataset: Dataset, sample: int, length: float, size: int) -> None:
    origin = dataset["grasp_position"].values[sample]
    axes = Rotation.from_quat(dataset["grasp_quaternion"].values[sample], scalar_first=True).as_matrix().T
    for axis, colour in zip(axes[:size], _FRAME, strict=False):
        line = np.stack([origin, origin + length * axis])
        panel.plot(*line.T[:size], color=colour, linewidth=1.3, zorder=7)
