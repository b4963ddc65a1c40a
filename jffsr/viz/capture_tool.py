"""The tool of a capture over time: its place and velocity beside the grasp frame's, and how the errors vanish."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from jffsr.viz.style import GREY, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_GRASP = {"linewidth": 2.6, "alpha": 0.3, "linestyle": "-"}
_LENGTHS = (
    ("error [m], [rad]", ((0, "position"), (3, "attitude"))),
    ("[m/s], [rad/s]", ((6, "velocity"), (9, "rate"))),
)
# Errors are drawn down to this: what is smaller is rounding, and a zero has no logarithm.
_LEAST = 1e-6


@styled
def draw_capture_tool(dataset: Dataset) -> Figure:
    """Five panels of a capture's result.nc: position, velocity and rate of the tool, then its errors in logarithms.

    The grasp frame's are the broad pale lines in the same colours. Errors are the lengths of the tool's position,
    rotation vector, velocity and rate less the grasp frame's, those to the true frame of an observed target dotted.
    """
    time = dataset["time"].values
    figure = new_figure(6.0)
    axes = figure.subplots(5, sharex=True, height_ratios=[1.15, 1, 1, 1.1, 1.1])
    rows = (
        ("position [m]", dataset["tool_position"], dataset["grasp_position"]),
        ("velocity [m/s]", dataset["tool_twist"][:, :3], dataset["grasp_twist"][:, :3]),
        ("rate [deg/s]", dataset["tool_twist"][:, 3:], dataset["grasp_twist"][:, 3:]),
    )
    for panel, (label, tool, grasp) in zip(axes, rows, strict=False):
        factor = 180 / np.pi if "deg" in label else 1.0
        for index in range(3):
            panel.plot(time, factor * grasp.values[:, index], **{**line_look(index), **_GRASP})
            panel.plot(time, factor * tool.values[:, index], **line_look(index))
        panel.set_ylabel(label)
    _draw_errors(axes[3:], dataset)
    for panel in axes:
        panel.margins(x=0)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    handles = [Line2D([], [], **line_look(index)) for index in range(3)]
    handles.append(Line2D([], [], **{"color": GREY, **_GRASP}))
    legend_above(figure, handles, ["tool x", "y", "z", "grasp frame"])
    return figure


def _draw_errors(panels, dataset: Dataset) -> None:
    time = dataset["time"].values
    for panel, (title, parts) in zip(panels, _LENGTHS, strict=True):
        for index, (first, name) in enumerate(parts):
            look = line_look(3 + index)
            panel.semilogy(
                time,
                _lengths(dataset, "grasp_error", first),
                **look,
                label=_named(name, dataset, "grasp_error", first),
            )
            if "true_grasp_error" in dataset:
                true = {**look, "linestyle": (0, (1, 1)), "linewidth": 1.4}
                panel.semilogy(
                    time, _lengths(dataset, "true_grasp_error", first), **true, label=f"{name}, true"
                )
        panel.set_ylabel(title)
        panel.yaxis.set_major_locator(LogLocator(numticks=5))
        panel.yaxis.set_minor_formatter(NullFormatter())
        panel.legend(loc="lower left")


def _named(name: str, dataset: Dataset, variable: str, first: int) -> str:
    """The name with the error at the end, which a logarithm over time hides."""
    return f"{name}, {np.linalg.norm(dataset[variable].values[-1, first : first + 3]):.1e} at the end"


def _lengths(dataset: Dataset, variable: str, first: int) -> np.ndarray:
    return np.maximum(np.linalg.norm(dataset[variable].values[:, first : first + 3], axis=1), _LEAST)
