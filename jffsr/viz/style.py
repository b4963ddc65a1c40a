"""One look for all figures: as wide as a column of a paper, small type, lines that survive a grey print.

The style is applied around each drawing and taken off again, so that a user's own settings stay as they were.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import wraps
from typing import ParamSpec, TypeVar

import matplotlib
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend

WIDTH = 3.5  # in
GREY = "0.45"
SHADE = "0.92"

# Okabe and Ito's palette, dark to light; its yellow is left out, since it is lost on white paper.
COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Six patterns to seven colours: the pair repeats only after 42 lines.
DASHES = (
    "-",
    (0, (5, 1.4)),
    (0, (1.2, 1.2)),
    (0, (5, 1.4, 1.2, 1.4)),
    (0, (10, 2.5)),
    (0, (7, 1.3, 1.2, 1.3, 1.2, 1.3)),
)

_SETTINGS = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handlelength": 2.7,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.25,
    "legend.borderaxespad": 0.2,
    "legend.borderpad": 0.2,
    "lines.linewidth": 1.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "ytick.minor.size": 1.5,
    "ytick.minor.width": 0.4,
    "patch.linewidth": 0.6,
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.03,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,  # letters as letters: publishers refuse type 3 fonts
    "text.usetex": False,
}

_P = ParamSpec("_P")
_R = TypeVar("_R")


def styled(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """The function, run in this style; the settings from before are back when it returns."""

    @wraps(function)
    def inside(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        with matplotlib.rc_context(_SETTINGS):
            return function(*args, **kwargs)

    return inside


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure of `width` and `height` in inches, with a canvas of its own and no window."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def line_look(index: int) -> dict:
    """Colour and dash pattern of line `index` of several."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index % len(DASHES)]}


def level_look(index: int) -> dict:
    """The same of choice `index` of several that are compared; black is left to the runs' own marks."""
    # As many colours as patterns: each round pairs them otherwise.
    turn, place = divmod(index, len(COLOURS) - 1)
    return {"color": COLOURS[1 + place], "linestyle": DASHES[(place + turn) % len(DASHES)]}


def legend_above(figure: Figure, handles: Sequence[Artist], labels: Sequence[str], **options) -> Legend:
    """One legend above all axes, read row by row, in as few rows as the figure's width allows."""
    count = len(handles)
    for rows in range(1, count + 1):
        columns = -(-count // rows)
        # Matplotlib fills columns; dealt out this way the rows read in order.
        order = [i for first in range(columns) for i in range(first, count, columns)]
        legend = figure.legend(
            [handles[i] for i in order],
            [labels[i] for i in order],
            loc="outside upper center",
            ncols=columns,
            **options,
        )
        if columns == 1 or legend.get_window_extent().width <= 0.98 * figure.bbox.width:
            break
        legend.remove()
    return legend
