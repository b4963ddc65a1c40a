"""Panels of a replay as drawings in a page, each with what a script needs to put a cursor on it."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from jffsr.viz.replay.replay import Panel
from jffsr.viz.replay.thinning import chosen_samples
from jffsr.viz.style import GREY, line_look, new_figure, styled

_POINTS, _FEWEST, _TOGETHER = 400, 150, 10_000
"""Points of a curve in a page: at most, at least where there are so many, and of a curve of each plot together."""
_SIZE = (4.4, 1.45)  # in


@dataclass(frozen=True)
class Plot:
    """A panel drawn: its svg, and the curves with as many points as a page needs.

    left and right, shares of the drawing's width, are where first and last lie; time (k,), s; values (c, k).
    """

    svg: str
    left: float
    right: float
    first: float
    last: float
    time: np.ndarray
    values: np.ndarray


def points_each(plots: int) -> int:
    """How many points the curves of each of so many plots have in one page."""
    return min(_POINTS, max(_FEWEST, _TOGETHER // max(plots, 1)))


@styled
def draw_panel(panel: Panel, marks: Sequence[tuple[str, float]], salt: str, points: int) -> Plot:
    """The panel as an svg without a legend, its curves of at most so many points.

    salt keeps apart what several drawings in one page call by name.
    """
    chosen = chosen_samples(panel.time, points)
    time = panel.time[chosen]
    values = np.array([curve[chosen] for curve in panel.curves.values()])
    figure = new_figure(_SIZE[1], _SIZE[0])
    axes = figure.subplots()
    for number, curve in enumerate(values):
        axes.plot(time, curve, **line_look(number))
    if panel.logarithmic:
        axes.set_yscale("log")
    for bound in panel.bounds:
        axes.axhline(bound, color=GREY, linestyle=(0, (4, 2)), linewidth=0.7)
    for _, instant in marks:
        axes.axvline(instant, color=GREY, linewidth=0.7, linestyle=(0, (1, 1.5)))
    first, last = float(panel.time[0]), float(panel.time[-1])
    axes.set_xlim(first, last)
    axes.set_xlabel("time [s]")
    svg = as_svg(figure, f"{panel.title}{salt}", f"{panel.title} over time")
    box = axes.get_position()
    return Plot(svg, float(box.x0), float(box.x1), first, last, time, values)


def as_svg(figure: Figure, salt: str, label: str) -> str:
    """A figure as an svg for a page, as wide as its place; label says what it shows to those who cannot see it.

    salt keeps apart what several drawings in one page call by name.
    """
    # Words as words: they stay sharp, can be searched, and take no room.
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}):
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", metadata={"Date": None}, transparent=True)
    text = buffer.getvalue()
    svg = re.sub(
        r'width="[^"]*pt" height="[^"]*pt"|height="[^"]*pt" width="[^"]*pt"',
        "",
        text[text.index("<svg") :],
        count=1,
    )
    # Without its name for the metadata's vocabulary a page asks nobody for anything, and says nothing it need not.
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    # Names of groups, which are the same in every drawing, and which nothing asks for.
    svg = re.sub(r'<g id="[\w.]+_\d+">', "<g>", svg)
    # A hundredth of a point is enough to draw with.
    svg = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]).replace("\n", " "), svg)
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(label, quote=True)}" ', 1)
