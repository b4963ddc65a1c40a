"""The best cost against what was spent, over the runs of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.study.sweep.table import keys_of, rows_of
from jffsr.viz.style import GREY, legend_above, level_look, new_figure, styled
from jffsr.viz.sweep_boxes import OPTIMIZER, label, lowest

if TYPE_CHECKING:
    from xarray import Dataset

_MOST_LINES = 12
_MOST_PANELS = 6
_GRID = 200


@styled
def draw_sweep_convergence(dataset: Dataset) -> Figure | None:
    """Median best J over the runs against objective and gradient evaluations together, with its quartiles.

    A line for each optimizer, or else for each setting; a panel for each of the other settings, the first six, whose
    axis ends four decades under the accuracy. Nothing is drawn until half of the runs have found a finite J; a panel in
    which that never happens says so. None where it happens in no panel, no step was kept, or the lines are too many.
    """
    keys = keys_of(dataset)
    of_lines = [OPTIMIZER] if OPTIMIZER in keys else keys
    of_panels = [key for key in keys if key not in of_lines]
    lines = [row.values for row in rows_of(dataset, of_lines)]
    panels = rows_of(dataset, of_panels)[:_MOST_PANELS]
    if not 1 <= len(lines) <= _MOST_LINES or not dataset.sizes.get("step"):
        return None
    curves = [_curves(dataset.isel(point=panel.points), of_lines, lines) for panel in panels]
    if not any(curves):
        return None
    columns = min(2, len(panels))
    deep = -(-len(panels) // columns)
    figure = new_figure(0.5 + 1.9 * deep, 3.5 * (1 if columns == 1 else 1.6))
    grid = figure.subplots(deep, columns, squeeze=False, sharex=True)
    for axes, panel, found in zip(grid.flat, panels, curves, strict=False):
        for order, curve in found.items():
            _draw(axes, curve, level_look(order))
        if not found:
            words = "no J in half of the runs"
            axes.text(0.5, 0.4, words, transform=axes.transAxes, ha="center", color=GREY)
        axes.set_xscale("log")
        axes.set_yscale("log")
        if dataset.attrs["accuracy"] > 0:
            axes.axhline(
                dataset.attrs["accuracy"], color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, zorder=1
            )
        bottom, top = axes.get_ylim()
        axes.set_ylim(max(bottom, lowest(dataset)), max(top, 10 * lowest(dataset)))
        if of_panels:
            axes.set_title(label(panel.values))
    for number in range(len(panels), grid.size):
        grid.flat[number].set_visible(False)
        grid.flat[number - columns].tick_params(axis="x", labelbottom=True)
    figure.supxlabel("objective + gradient evaluations", fontsize=8)
    figure.supylabel("best J [-], median and quartiles", fontsize=8)
    if len(lines) > 1 or of_lines == [OPTIMIZER]:
        handles = [Line2D([], [], **level_look(order)) for order in range(len(lines))]
        legend_above(figure, handles, [label(values) for values in lines])
    return figure


class _Curve(NamedTuple):
    """After `at` evaluations, (k,), quartiles of the best J; infinite where too few runs have found one."""

    at: np.ndarray
    lower: np.ndarray
    middle: np.ndarray
    upper: np.ndarray


def _curves(panel: Dataset, keys: Sequence[str], lines: Sequence[dict]) -> dict[int, _Curve]:
    """The curves of a panel by their places among the lines; none of what half of the runs never found."""
    found = {}
    for row in rows_of(panel, keys):
        curve = _curve(panel.isel(point=row.points))
        if curve is not None and np.any(np.isfinite(curve.middle)):
            found[lines.index(row.values)] = curve
    return found


def _curve(runs: Dataset) -> _Curve | None:
    spent = runs["history_evaluations"].values + runs["history_gradient_evaluations"].values
    best = np.where(np.isnan(runs["history_best_value"].values), np.inf, runs["history_best_value"].values)
    known = spent[np.isfinite(spent)]
    if not known.size:
        return None
    at = np.geomspace(max(known.min(), 1), max(known.max(), 2), _GRID)
    values = np.stack([_held(one, cost, at) for one, cost in zip(spent, best, strict=True)])
    # Beside a run that has found nothing yet there is nothing to interpolate.
    lower, upper = np.quantile(values, [0.25, 0.75], axis=0, method="nearest")
    return _Curve(at, lower, np.median(values, axis=0), upper)


def _draw(axes, curve: _Curve, look: dict) -> None:
    half = np.isfinite(curve.middle)
    axes.plot(curve.at[half], curve.middle[half], **look)
    full = half & np.isfinite(curve.upper)
    axes.fill_between(
        curve.at[full], curve.lower[full], curve.upper[full], color=look["color"], alpha=0.15, linewidth=0
    )


def _held(spent: np.ndarray, best: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The best value after `at` evaluations: what was last found by then, infinite before the first."""
    inside = np.isfinite(spent)
    # The optimizers stand still at the end of a budget: of equal counts the last holds.
    index = np.searchsorted(spent[inside], at, side="right") - 1
    return np.where(index >= 0, best[inside][np.maximum(index, 0)], np.inf)
