"""From where a figure looks at a robot: from above or in space, with one scale, filling its figure."""

from __future__ import annotations

from itertools import product

import numpy as np
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d

_ELEVATION = 20.0  # deg


def frame_plane(axes, low: np.ndarray, high: np.ndarray) -> None:
    """Frame a view from above: the box from low (3,) to high (3,), m, seen along -z."""
    axes.set_aspect("equal")
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x [m]", ylabel="y [m]")


def frame_space(axes, low: np.ndarray, high: np.ndarray, azimuth: float, labelpad: float = -8) -> np.ndarray:
    """Frame a view in three dimensions of the box from low to high; the direction (3,) to the reader."""
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low)
    axes.set_proj_type("ortho")
    axes.view_init(elev=_ELEVATION, azim=azimuth)
    longest = (high - low).max()
    for name, axis, span in zip("xyz", (axes.xaxis, axes.yaxis, axes.zaxis), high - low, strict=True):
        axis.set_major_locator(MaxNLocator(max(1, round(4 * span / longest)), steps=[1, 2, 5, 10]))
        axis.set_pane_color((1, 1, 1, 0))
        axis.set_tick_params(pad=-3)
        axis.set_label_text(f"{name} [m]")
        axis.labelpad = labelpad
        axis._axinfo["grid"].update(color="0.9", linewidth=0.4)
    return towards_reader(azimuth)


def fill(
    figure: Figure,
    axes,
    legend: Legend,
    tallest: float,
    margins: tuple[float, float] = (0.0, 0.0),
    close: bool = False,
) -> None:
    """Scale and move a view in three dimensions so that it fills the figure under its legend.

    The view becomes as wide as the figure less its margins, left and right, or as tall as `tallest`,
    whichever comes first; the figure's height follows. All in inches. `close` measures what is seen, which
    may leave the axes' own square hanging over the page; otherwise the square stays on it.
    """
    figure.set_layout_engine("none")
    width = figure.get_figwidth()
    wide = width - sum(margins)
    middle_x = margins[0] + 0.5 * wide
    head = legend.get_window_extent().height / figure.dpi
    place = np.array([middle_x, 0.5 * wide])  # centre of the square that holds the view
    side, total = 0.8 * wide, wide
    # Words do not grow with the view, hence more than one round.
    for _ in range(3):
        figure.set_size_inches(width, total)
        left, bottom = place - 0.5 * side
        axes.set_position((left / width, bottom / total, side / width, side / total))
        renderer = figure.canvas.get_renderer()
        box = _seen(axes, renderer) if close else axes.get_tightbbox(renderer)
        middle = np.array([box.x0 + box.x1, box.y0 + box.y1]) / (2 * figure.dpi) - place
        scale = min((wide - 0.1) * figure.dpi / box.width, tallest * figure.dpi / box.height)
        side, total = scale * side, scale * box.height / figure.dpi + head + 0.15
        place = np.array([middle_x, 0.05 + 0.5 * scale * box.height / figure.dpi]) - scale * middle
    figure.set_size_inches(width, total)
    left, bottom = place - 0.5 * side
    axes.set_position((left / width, bottom / total, side / width, side / total))


def _seen(axes, renderer) -> Bbox:
    """What the words and the eight corners of a view in three dimensions cover on the page, in pixels."""
    corners = np.array(list(product(axes.get_xlim(), axes.get_ylim(), axes.get_zlim())))
    words = [axis.get_tightbbox(renderer) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    hull = Bbox.null()
    hull.update_from_data_xy(project(axes, corners), ignore=True)
    return Bbox.union([hull, *(box for box in words if box is not None)])


def project(axes, points: np.ndarray) -> np.ndarray:
    """Where points (n, 3) of a view in three dimensions are seen, (n, 2), in pixels of the figure."""
    axes.apply_aspect()
    return axes.transData.transform(flatten(axes, points))


def flatten(axes, points: np.ndarray) -> np.ndarray:
    """Points (..., 3) of a view in three dimensions in its own two coordinates, (..., 2)."""
    x, y, _ = proj3d.proj_transform(*points.reshape(-1, 3).T, axes.get_proj())
    return np.stack([x, y], axis=-1).reshape(*points.shape[:-1], 2)


def towards_reader(azimuth: float) -> np.ndarray:
    """The direction (3,) from what is drawn to a reader at this azimuth, deg."""
    e, a = np.deg2rad(_ELEVATION), np.deg2rad(azimuth)
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def across_view(towards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The directions (3,) to the right and up on the page of a view from `towards`, z standing upright."""
    right = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    return right, np.cross(towards, right)


def viewpoint(points: np.ndarray, base: np.ndarray) -> float:
    """Azimuth, deg, from where points (..., 3) of an arm cover most of the picture, in front of the base (3,)."""
    arm = points.reshape(-1, 3) - base
    spread = arm - arm.mean(axis=0)
    reach = np.linalg.norm(arm.mean(axis=0)) + 1e-9

    def merit(azimuth: float) -> float:
        towards = towards_reader(azimuth)
        seen = spread @ np.stack(across_view(towards), axis=1)
        area = np.prod(np.linalg.svd(seen, compute_uv=False))
        return float(area * (1.5 + arm.mean(axis=0) @ towards / reach))

    # Never along an axis, which would put the words of two axes on each other.
    return max((quarter + turn for quarter in (-180, -90, 0, 90) for turn in (30, 45, 60)), key=merit)
