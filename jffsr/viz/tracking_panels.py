"""Panels over time of tracked motions: one row for each quantity, one column for each motion that is compared."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from jffsr.viz.limits import frame_curves
from jffsr.viz.style import GREY, WIDTH, new_figure
from jffsr.viz.tracked_run import TrackedRun

NEAR_COLOUR = "#FBE3D1"
LEAST = "least $\\sigma$"
"""What a legend calls an instant at which the smallest singular value is least."""
_MARK = {"color": GREY, "linestyle": (0, (1, 1.5)), "linewidth": 0.8}
_LARGER = 5.0  # times
_WIDEST = 7.2  # in, both columns of a paper


def new_panels(rows: int, runs: dict[str, TrackedRun], height: float) -> tuple[Figure, np.ndarray]:
    """A figure of `height`, in, with panels (rows, runs); a row shares its heights, a column its time."""
    width = min(_WIDEST, max(WIDTH, 0.5 + 2.1 * len(runs)))
    figure = new_figure(height, width)
    panels = figure.subplots(rows, len(runs), sharex="col", sharey="row", squeeze=False)
    for column, (name, run) in enumerate(runs.items()):
        if name:
            panels[0, column].set_title(name)
        panels[-1, column].set_xlabel("time [s]")
        for axes in panels[:, column]:
            if run.time[-1] > run.time[0]:
                axes.set_xlim(run.time[0], run.time[-1])
            mark_singularities(axes, run)
    return figure, panels


def mark_singularities(axes: Axes, run: TrackedRun) -> None:
    """Shade the stretches of a run that are near a singularity, and mark its singular instants."""
    for start, end in near_stretches(run):
        axes.axvspan(start, end, color=NEAR_COLOUR, alpha=0.75, linewidth=0, zorder=0.2, gid="near")
    for time in run.singular_times:
        axes.axvline(time, **_MARK, zorder=0.5, gid="singular")


def near_stretches(run: TrackedRun) -> list[tuple[float, float]]:
    """Start and end, s, of each stretch of samples near a singularity, half an interval wider at either end."""
    edges = np.diff(np.concatenate([[0], run.near.astype(int), [0]]))
    time = np.asarray(run.time)
    middles = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    return [
        (middles[a], middles[b]) for a, b in zip(*(np.flatnonzero(edges == s) for s in (1, -1)), strict=True)
    ]


def frame_row(
    axes_row: Sequence[Axes],
    curves: Sequence[np.ndarray],
    lower: np.ndarray,
    upper: np.ndarray,
    names: Sequence[str],
    usual: Callable[[list[float]], float] = min,
) -> bool:
    """Set one vertical range for a row of panels with curves (k, j) each, draw the limits (j,) near; whether any was.

    A panel whose curves are many times larger than usual would flatten those of the others: it is cut off, and says
    how far its curves go. usual: what is, of the panels' largest values.
    """
    sizes = [largest_finite(np.abs(values)) for values in curves]
    level = usual([size for size in sizes if size > 0] or [1.0])
    common = [size <= _LARGER * level for size in sizes]
    shown = np.concatenate([values for values, within in zip(curves, common, strict=True) if within])
    near = False
    for axes, size, within in zip(axes_row, sizes, common, strict=True):
        near |= frame_curves(axes, shown, lower, upper, names)
        if not within:
            for text in [text for text in axes.texts if text.get_gid() == "far limit"]:
                text.remove()
            axes.annotate(
                f"cut off: up to {float(f'{size:.3g}'):g}",
                (0.0, 1.0),
                xycoords="axes fraction",
                xytext=(3, -2),
                textcoords="offset points",
                va="top",
                fontsize=6,
                color="0.3",
                gid="cut off",
                zorder=9,
            )
    return near


def largest_finite(values: np.ndarray) -> float:
    """The largest finite value, zero where there is none."""
    finite = np.asarray(values)[np.isfinite(values)]
    return float(finite.max()) if finite.size else 0.0


def mark_handles(runs: Sequence[TrackedRun]) -> tuple[list, list[str]]:
    """What a legend has to say of the marks that the runs have."""
    handles, labels = [], []
    if any(run.near.any() for run in runs):
        handles.append(Patch(color=NEAR_COLOUR, alpha=0.75, linewidth=0))
        labels.append("near singular")
    if any(len(run.singular_times) for run in runs):
        handles.append(Line2D([], [], **_MARK))
        labels.append(LEAST)
    return handles, labels
