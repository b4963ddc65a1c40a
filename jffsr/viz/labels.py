"""Names of joints beside a drawing, each tied to its joint, none on another."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from jffsr.viz.style import GREY
from jffsr.viz.view import project

_SIZE = 6.5  # pt
_GAP = 0.14  # in, from one line to the next
_AIR = 0.12  # in, between the words and the view


def label_widths(figure: Figure, axes, names: list[str], points: np.ndarray) -> tuple[float, float]:
    """Margins, left and right, in, that the names of points (n, 3) need beside a view in three dimensions."""
    sides = _sides(_on_page(figure, axes, points))
    widths = [_width(figure, name) for name in names]
    return tuple(
        max((width for width, side in zip(widths, sides, strict=True) if side == which), default=0.0) + _AIR
        for which in (0, 1)
    )


def draw_labels(figure: Figure, axes, names: list[str], points: np.ndarray) -> None:
    """Write the names of points (n, 3): in columns left and right of a view in space, beside them in a plane."""
    if axes.name != "3d":
        for name, point in zip(names, points, strict=True):
            axes.annotate(
                name, point[:2], (0, 9), textcoords="offset points", ha="center", fontsize=_SIZE, zorder=9
            )
        return
    place = _on_page(figure, axes, points)
    sides = _sides(place)
    width, height = figure.get_size_inches()
    for side in (0, 1):
        chosen = np.flatnonzero(sides == side)
        chosen = chosen[np.argsort(place[chosen, 1], kind="stable")]
        column = max((_width(figure, names[i]) for i in chosen), default=0.0)
        x = column + 0.02 if side == 0 else width - column - 0.02
        for i, y in zip(chosen, _apart(place[chosen, 1], 0.1, height - 0.5), strict=True):
            figure.text(
                x / width,
                y / height,
                names[i],
                fontsize=_SIZE,
                va="center",
                ha="right" if side == 0 else "left",
            )
            end = x + 0.04 if side == 0 else x - 0.04
            axes.annotate(
                "",
                xy=place[i] / (width, height),
                xytext=(end / width, y / height),
                xycoords="figure fraction",
                arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 1.5},
                annotation_clip=False,
                zorder=4,
            )


def _on_page(figure: Figure, axes, points: np.ndarray) -> np.ndarray:
    """Where points (n, 3) are seen, (n, 2), in from the figure's lower left corner."""
    return project(axes, points) / figure.dpi


def _sides(place: np.ndarray) -> np.ndarray:
    """Left (0) or right (1) for each of the points (n, 2): half of them on each side."""
    order = np.argsort(place[:, 0], kind="stable")
    sides = np.empty(len(place), dtype=int)
    sides[order] = np.arange(len(place)) >= len(place) // 2
    return sides


def _width(figure: Figure, name: str) -> float:
    text = Text(0, 0, name, fontsize=_SIZE, figure=figure)
    return text.get_window_extent(figure.canvas.get_renderer()).width / figure.dpi


def _apart(heights: np.ndarray, low: float, high: float) -> np.ndarray:
    """Sorted heights moved as little as needed to stand a line apart, between low and high where they fit."""
    if len(heights) == 0:
        return heights
    gap = min(_GAP, (high - low) / max(1, len(heights) - 1))
    steps = gap * np.arange(len(heights))
    # Without the steps "a line apart" reads "in order", which pooling neighbours does.
    wanted = heights - steps
    pools: list[list[float]] = []
    for value in wanted:
        pools.append([value, 1])
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            value, count = pools.pop()
            total = pools[-1][1] + count
            pools[-1] = [(pools[-1][0] * pools[-1][1] + value * count) / total, total]
    flat = np.concatenate([np.full(count, value) for value, count in pools])
    return np.clip(flat, low, max(low, high - steps[-1])) + steps
