"""The best index found against what was spent to find it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jffsr.viz.style import COLOURS, GREY, SHADE, WIDTH, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset


@styled
def draw_convergence(dataset: Dataset) -> Figure:
    """Best J of a run against its evaluations, on a logarithmic scale, with its phases and the accuracy.

    dataset is a run's result.nc. A gradient evaluation counts as one evaluation more, in addition to the
    objective evaluation it came with; the charge of each phase stands under its name. Before the first finite
    J nothing is drawn.
    """
    objective = dataset["history_evaluations"].values.astype(float)
    gradient = dataset["history_gradient_evaluations"].values.astype(float)
    spent = objective + gradient
    best = np.asarray(dataset["history_best_value"].values, float)
    accuracy = float(dataset.attrs["accuracy"])

    figure = new_figure(2.3)
    axes = figure.subplots()
    shown = _on_log_scale(best, accuracy)
    # A value holds from the evaluation that found it until a better one is found.
    axes.step(spent, shown, where="post", color=COLOURS[1])
    if np.isfinite(shown).any():
        axes.plot(spent[-1:], shown[-1:], "o", color=COLOURS[1], markersize=3, clip_on=False)
    else:
        axes.text(0.5, 0.5, "no finite J was found", transform=axes.transAxes, ha="center", color=GREY)
    if accuracy > 0:
        axes.axhline(accuracy, color=COLOURS[2], linestyle=(0, (4, 2)), linewidth=0.8, gid="accuracy")
        axes.annotate(
            f"accuracy J = {accuracy:g}",
            (0.0, accuracy),
            xycoords=("axes fraction", "data"),
            xytext=(3, -2),
            textcoords="offset points",
            va="top",
            fontsize=7,
            color=COLOURS[2],
        )
    axes.set_yscale("log")
    _set_range(axes, shown, accuracy)
    axes.set_xlim(0, max(spent[-1] if spent.size else 0.0, 1.0))
    _mark_phases(axes, dataset, objective, gradient)
    axes.set_xlabel("objective + gradient evaluations")
    axes.set_ylabel("best J [-]")
    return figure


def _on_log_scale(best: np.ndarray, accuracy: float) -> np.ndarray:
    """Values to draw: nan for what is not finite, and what is not positive at a tenth of the least positive."""
    shown = np.where(np.isfinite(best), best, np.nan)
    positive = [*shown[shown > 0], *([accuracy] if accuracy > 0 else [])]
    return np.where(shown <= 0, 0.1 * min(positive, default=1.0), shown)


def _set_range(axes: Axes, shown: np.ndarray, accuracy: float) -> None:
    marks = [*shown[np.isfinite(shown)], *([accuracy] if accuracy > 0 else [])] or [1.0]
    low, high = np.log10(min(marks)), np.log10(max(marks))
    pad = max(0.06 * (high - low), 0.1)
    # Room under the accuracy line for its own words.
    axes.set_ylim(10 ** (low - max(pad, 0.16 * (high - low))), 10 ** (high + pad))


def _mark_phases(axes: Axes, dataset: Dataset, objective: np.ndarray, gradient: np.ndarray) -> None:
    """Shade every second phase, and write above each its name and what it was charged."""
    names = json.loads(dataset.attrs["phase_names"])
    phases = dataset["history_phase"].values
    before, ends = (0.0, 0.0), []  # `ends`: how far each row of words is filled, in points
    words_width = 0.82 * 72 * WIDTH  # about the width of the axes, in points
    scale = words_width / axes.get_xlim()[1]
    for number in np.unique(phases):
        last = np.flatnonzero(phases == number)[-1]
        after = (objective[last], gradient[last])
        left, right = sum(before), sum(after)
        if left > 0:
            axes.axvline(left, color=GREY, linewidth=0.6, linestyle=":", gid="phase")
        if number % 2:
            axes.axvspan(left, right, color=SHADE, linewidth=0, zorder=0)
        name = names[number] if number < len(names) else f"phase {number + 1}"
        text = f"{name}: {after[0] - before[0]:.0f} J"
        if after[1] > before[1]:
            text += f" + {after[1] - before[1]:.0f} ∇J"
        width = _text_width(axes, text)
        middle = 0.5 * (left + right)
        start = min(max(middle * scale - width / 2, 0.0), max(words_width - width, 0.0))
        row = next((row for row, end in enumerate(ends) if end < start), len(ends))
        ends[row : row + 1] = [start + width + 6]
        axes.annotate(
            text,
            (middle, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(start + width / 2 - middle * scale, 4 + 9 * row),
            textcoords="offset points",
            ha="center",
            va="bottom",
            fontsize=6.5,
            gid="phase",
            arrowprops={"arrowstyle": "-", "color": GREY, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0},
        )
        before = after


def _text_width(axes: Axes, text: str) -> float:
    drawn = axes.text(0, 0, text, fontsize=6.5)
    width = drawn.get_window_extent().width * 72 / axes.figure.dpi
    drawn.remove()
    return width
