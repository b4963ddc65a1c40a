"""The best index found against what was spent to find it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.viz.style import GREY, SHADE, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset


# How far below the accuracy the axis goes: what lies deeper matters to nobody and would flatten the rest.
_DEPTH = 1e-4


@styled
def draw_convergence(dataset: Dataset) -> Figure:
    """Best J of a run against its evaluations, on a logarithmic scale, with its phases and the accuracy.

    dataset is a run's result.nc. The horizontal axis charges one for an objective evaluation and one for a
    gradient (its value included); the legend has each phase's bill. Nothing is drawn before the first
    finite J. The axis ends four decades under the accuracy; an end further down is a triangle at its foot.
    """
    objective = dataset["history_evaluations"].values.astype(float)
    gradient = dataset["history_gradient_evaluations"].values.astype(float)
    phases = dataset["history_phase"].values
    best = np.asarray(dataset["history_best_value"].values, float)
    best = np.where(np.isfinite(best), best, np.nan)
    accuracy = float(dataset.attrs["accuracy"])
    names = json.loads(dataset.attrs["phase_names"])

    figure = new_figure(2.3)
    axes = figure.subplots()
    floor, ceiling = _range(best, accuracy)
    handles, labels, spent = [], [], objective + gradient
    for order, phase in enumerate(np.unique(phases)):
        inside = np.flatnonzero(phases == phase)
        before = inside[0] - 1
        look = line_look(order)
        handles.append(Line2D([], [], **look))
        labels.append(
            f"{names[phase] if phase < len(names) else f'phase {phase + 1}'}: "
            + _bill(objective, before, inside[-1], gradient)
        )
        left = spent[before] if before >= 0 else 0.0
        if before >= 0:
            axes.axvline(left, color=GREY, linewidth=0.6, linestyle=":", gid="phase")
        if order % 2:
            axes.axvspan(left, spent[inside[-1]], color=SHADE, linewidth=0, zorder=0)
        # A value holds from the evaluation that found it until a better one is, also in the next phase.
        rows = np.arange(max(before, 0), inside[-1] + 1)
        axes.step(spent[rows], np.maximum(best[rows], 0.1 * floor), where="post", **look)
    if np.isfinite(best).any():
        end = best[-1]
        mark = {"color": handles[-1].get_color(), "marker": "o" if end >= floor else "v", "markersize": 4}
        axes.plot(spent[-1], max(end, floor), linestyle="none", clip_on=False, zorder=5, **mark)
        handles.append(Line2D([], [], linestyle="none", **mark))
        labels.append(f"end: J = {end:.4g}")
    else:
        axes.text(0.5, 0.5, "no finite J was found", transform=axes.transAxes, ha="center", color=GREY)
    axes.set_yscale("log")
    axes.set_ylim(floor, ceiling)
    axes.set_xlim(0, max(spent[-1] if spent.size else 0.0, 1.0))
    _mark_accuracy(axes, accuracy)
    axes.set_xlabel("objective + gradient evaluations")
    axes.set_ylabel("best J [-]")
    if handles:
        legend_above(figure, handles, labels)
    return figure


def _bill(objective: np.ndarray, before: int, last: int, gradient: np.ndarray) -> str:
    """What a phase spent: its objective evaluations, and its gradients where it took any."""
    spent = [counts[last] - (counts[before] if before >= 0 else 0.0) for counts in (objective, gradient)]
    parts = [f"{count:.0f} {unit}" for count, unit in zip(spent, ("J", "∇J"), strict=True) if count > 0]
    return " + ".join(parts) or "nothing"


def _range(best: np.ndarray, accuracy: float) -> tuple[float, float]:
    """Least and greatest J on the axis, with room around the values and the accuracy."""
    marks = [*best[best > 0], *([accuracy] if accuracy > 0 else [])] or [1.0]
    low, high = min(marks), max(marks)
    if accuracy > 0:
        low = max(low, _DEPTH * accuracy)
    pad = max((high / low) ** 0.15, 1.5, (11.0 * low / high) ** (2 / 3))  # at least a decade in all
    return low / pad, high * pad**0.5


def _mark_accuracy(axes: Axes, accuracy: float) -> None:
    if not accuracy > 0:
        return
    axes.axhline(accuracy, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8, zorder=1, gid="accuracy")
    axes.annotate(
        f"accuracy: J = {accuracy:g}",
        (0.0, accuracy),
        xycoords=("axes fraction", "data"),
        xytext=(3, -2),
        textcoords="offset points",
        va="top",
        fontsize=7,
        color="0.3",
    )
