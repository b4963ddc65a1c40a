"""The base's attitude and place over time, with the excursion limits that are near."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.viz.limits import frame_curves
from jffsr.viz.style import GREY, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset


@styled
def draw_base(dataset: Dataset) -> Figure:
    """Two stacked panels of a run's base: attitude angles from the start, deg, and the way it has moved.

    dataset is a run's result.nc. The second panel shows the displacement of the base's centre of mass from
    where it was at the start, resolved in I, in m or, where it stays under 0.2 m, in mm.
    """
    names = [str(name) for name in dataset["axis"].values]
    time = dataset["time"].values
    figure = new_figure(2.9)
    upper_axes, lower_axes = figure.subplots(2, sharex=True)

    angles = np.rad2deg(dataset["attitude_angle"].values)
    limit = np.rad2deg(dataset["excursion_limit"].values)
    position = dataset["base_position"].values
    moved = position - position[:1]
    small = bool(np.nanmax(np.abs(moved), initial=0.0) < 0.2)
    if small:
        moved = 1e3 * moved
    for axes, values in ((upper_axes, angles), (lower_axes, moved)):
        for index, curve in enumerate(values.T):
            axes.plot(time, curve, **line_look(index))
        axes.margins(x=0)
    near = frame_curves(upper_axes, angles, -limit, limit, names)
    frame_curves(lower_axes, moved, *2 * [np.full(len(names), np.inf)], names)
    upper_axes.set_ylabel("attitude angle [deg]")
    lower_axes.set_ylabel(f"displacement [{'mm' if small else 'm'}]")
    lower_axes.set_xlabel("time [s]")
    figure.align_ylabels()
    handles = [Line2D([], [], **line_look(index)) for index in range(len(names))]
    if near:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (4, 2)), linewidth=0.7))
    legend_above(figure, handles, [*names, "limit"][: len(handles)])
    return figure
