"""The front of a capture between two indices, with the solutions that were chosen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from jffsr.viz.style import COLOURS, GREY, legend_above, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_MARKS = ("o", "s", "D", "^", "v")


@styled
def draw_front(dataset: Dataset) -> Figure:
    """Both indices of every solution of a capture's result.nc, joined in order; chosen ones by name."""
    values = dataset["front_value"].values
    chosen = [str(name) for name in dataset["front_chosen"].values]
    first, second = (str(name).replace("_", " ") for name in dataset["index"].values)
    figure = new_figure(2.6)
    axes = figure.subplots()
    order = np.argsort(values[:, 0], kind="stable")
    line = axes.plot(*values[order].T, color=GREY, linewidth=0.7, marker="o", markersize=3, fillstyle="none")
    handles, labels = list(line), ["solution"]
    named = [number for number, name in enumerate(chosen) if name]
    for index, number in enumerate(named):
        look = {"color": COLOURS[1 + index % 6], "marker": _MARKS[index % len(_MARKS)], "linestyle": "none"}
        handles += axes.plot(*values[number], **look, markersize=5.5, zorder=3)
        labels.append(chosen[number].replace("_", " "))
    axes.set(xlabel=f"{first} [-]", ylabel=f"{second} [-]")
    axes.margins(0.08)
    legend_above(figure, handles, labels)
    return figure
