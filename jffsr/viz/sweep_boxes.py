"""How the cost of each setting of a sweep spreads over its seeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from jffsr.study.sweep.table import Row, keys_of, rows_of
from jffsr.viz.style import GREY, legend_above, level_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

OPTIMIZER = "optimizer.kind"
MOST_ROWS = 40
_ROW = 0.2  # in
_DEPTH = 1e-4  # as in a run's convergence: what lies deeper below the accuracy would flatten the rest
_LABEL = 46  # letters


@styled
def draw_boxes(dataset: Dataset) -> Figure | None:
    """A box a setting, J on a logarithmic axis: quartiles, whiskers to the outermost runs, every run a dot.

    dataset is a sweep's sweep.nc. The axis ends four decades under the accuracy; runs further down are triangles at its
    end. Optimizers, where they are swept, have colours. None where there are no two settings, or more than fit on a
    page. A setting without a finite J is said to have none.
    """
    keys = keys_of(dataset)
    coloured = OPTIMIZER if OPTIMIZER in keys else None
    rows = rows_of(dataset, [key for key in keys if key != coloured] + ([coloured] if coloured else []))
    if not 2 <= len(rows) <= MOST_ROWS:
        return None
    # Settings that differ in their optimizer alone stand together.
    places = list(dict.fromkeys(label(row.values, coloured) for row in rows))
    rows.sort(key=lambda row: places.index(label(row.values, coloured)))
    levels = list(dict.fromkeys(row.values[coloured] for row in rows)) if coloured else [None]
    figure = new_figure(0.9 + _ROW * len(rows))
    axes = figure.subplots()
    ticks: dict[str, list[float]] = {}
    place, last, floor = 0.0, None, lowest(dataset)
    for row in rows:
        name = label(row.values, coloured)
        place += 1.0 if name == last or last is None else 1.5 if coloured else 1.0
        last = name
        ticks.setdefault(name, []).append(place)
        colour = level_look(levels.index(row.values[coloured]) if coloured else 0)["color"]
        _box(axes, place, row, colour, floor)
    axes.set_yticks([float(np.mean(at)) for at in ticks.values()], list(ticks))
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(place + 0.8, 0.2)
    axes.set_xscale("log")
    # A box without width would end the axis.
    axes.use_sticky_edges = False
    axes.margins(x=0.05)
    if any(np.any(row.cost <= floor) for row in rows):
        axes.set_xlim(left=0.7 * floor)
    axes.set_xlabel("J [-]")
    _mark_accuracy(axes, float(dataset.attrs["accuracy"]))
    handles = [
        Patch(facecolor=level_look(i)["color"], alpha=0.35) for i in range(len(levels) if coloured else 0)
    ]
    names = [str(level) for level in levels] if coloured else []
    if dataset.attrs["accuracy"] > 0:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (4, 2)), linewidth=0.8))
        names.append(f"accuracy: J = {dataset.attrs['accuracy']:g}")
    if any(np.any(row.cost <= floor) for row in rows):
        handles.append(Line2D([], [], marker="<", markersize=3, color=GREY, linestyle=""))
        names.append(f"J below {floor:.3g}")
    if handles:
        legend_above(figure, handles, names)
    return figure


def label(values: dict, without: str | None = None) -> str:
    """A setting in few letters: the last parts of its keys, and their values."""
    parts = [f"{key.rpartition('.')[2]} {_short(value)}" for key, value in values.items() if key != without]
    text = ", ".join(parts)
    return text if len(text) <= _LABEL else text[: _LABEL - 1] + "…"


def _short(value) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def lowest(dataset: Dataset) -> float:
    """The least J that is drawn."""
    return max(_DEPTH * float(np.nan_to_num(dataset.attrs["accuracy"])), 1e-300)


def _box(axes, place: float, row: Row, colour: str, floor: float) -> None:
    cost = np.maximum(row.cost[np.isfinite(row.cost)], floor)
    if not cost.size:
        axes.text(0.5, place, "no finite J", transform=axes.get_yaxis_transform(), va="center", color=GREY)
        return
    if lost := row.cost.size - cost.size:
        words = f"{lost} of {row.cost.size} without J"
        axes.text(
            1.01, place, words, transform=axes.get_yaxis_transform(), va="center", fontsize=5.5, color=GREY
        )
    low, lower, middle, upper, high = np.quantile(cost, [0, 0.25, 0.5, 0.75, 1])
    axes.plot([low, high], [place, place], color=colour, linewidth=0.8, zorder=2)
    axes.barh(place, upper - lower, 0.62, left=lower, color=colour, alpha=0.35, linewidth=0, zorder=2)
    axes.plot([middle, middle], [place - 0.31, place + 0.31], color=colour, linewidth=1.4, zorder=3)
    # Spread by their order, so that equal ones are seen.
    offsets = np.linspace(-0.2, 0.2, cost.size) if cost.size > 1 else np.zeros(1)
    deep = cost <= floor
    axes.plot(cost[~deep], (place + offsets)[~deep], "o", markersize=1.6, color="black", zorder=4)
    axes.plot(cost[deep], (place + offsets)[deep], "<", markersize=3, color=colour, clip_on=False, zorder=4)


def _mark_accuracy(axes, accuracy: float) -> None:
    if accuracy > 0:
        axes.axvline(accuracy, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, zorder=1)
