"""How far bodies keep apart over a motion, against the margin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.viz.style import GREY, SHADE, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_MOST = 6
_LIMIT = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 0.7}
_OTHERS = {"color": "0.8", "linewidth": 0.6, "zorder": 1}


@styled
def draw_clearance(dataset: Dataset) -> Figure:
    """Signed distances over time, m, of the six pairs of bodies that come nearest, the others pale; the margin shaded.

    dataset is the result.nc of a plan or a capture that keeps its bodies apart.
    """
    distances, time = dataset["clearance"].values, dataset["time"].values
    names = [str(name) for name in dataset["pair"].values]
    order = np.argsort(distances.min(axis=1), kind="stable")
    figure = new_figure(2.7)
    axes = figure.subplots()
    for pair in order[_MOST:]:
        axes.plot(time, distances[pair], **_OTHERS)
    for index, pair in enumerate(order[:_MOST]):
        axes.plot(time, distances[pair], **line_look(index))
    margin = float(dataset.attrs["margin"])
    axes.axhline(margin, **_LIMIT)
    top = 1.15 * max(distances[order[:_MOST]].max(), margin)
    low = min(0.0, 1.1 * distances.min())
    axes.axhspan(low, margin, color=SHADE, linewidth=0, zorder=0)
    axes.set_ylim(low, top)
    axes.margins(x=0)
    axes.set(xlabel="time [s]", ylabel="distance [m]")
    handles = [Line2D([], [], **line_look(index)) for index in range(min(_MOST, len(order)))]
    labels = [names[pair] for pair in order[:_MOST]]
    if len(order) > _MOST:
        handles.append(Line2D([], [], **_OTHERS))
        labels.append("others")
    legend_above(figure, [*handles, Line2D([], [], **_LIMIT)], [*labels, "margin"])
    return figure
