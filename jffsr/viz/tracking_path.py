"""The way of the tool beside its target in space, with what is near a singularity in colour."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from jffsr.errors import InputError
from jffsr.viz.style import COLOURS, WIDTH, legend_above, level_look, new_figure, styled
from jffsr.viz.tracked_run import Runs, TrackedRun, runs_by_name
from jffsr.viz.tracking_panels import LEAST, largest_finite
from jffsr.viz.view import fill, frame_plane, frame_space

_TALLEST = 3.4  # in
_AZIMUTH = -60.0  # deg
# Deviations are drawn about this share of the path's length, so that they can be seen.
_SEEN = 0.12
_MOST = 1000.0  # times; what is smaller still is as good as none
_TARGET = {"color": COLOURS[0], "linewidth": 0.9}
_NEAR = {"color": "#F0A868", "linewidth": 4.0, "solid_capstyle": "butt"}
_INSTANT = {
    "color": COLOURS[0],
    "linestyle": "none",
    "marker": "x",
    "markersize": 4.5,
    "markeredgewidth": 1.0,
}
# A side of the box shorter than this share of the longest is stretched to it: most paths are nearly straight.
_THINNEST = 0.55


@styled
def draw_tool_path(runs: Runs, exaggeration: float | None = None) -> Figure:
    """The tool's way beside its target, in I: the deviation many times enlarged, and near-singular stretches in colour.

    exaggeration: how many times; a round number by default, from the largest deviation, which the legend names; 1 draws
    the true way. Each axis has its own scale where the path is thin. Ways that stay in one height are drawn from above.
    Raises InputError for an exaggeration that is not positive.
    """
    named = runs_by_name(runs)
    if exaggeration is not None and not 0 < exaggeration < np.inf:
        raise InputError(f"exaggeration is {exaggeration}; it must be positive and finite")
    first = next(iter(named.values()))
    deviations = {name: np.asarray(run.tool_position) - run.target_position for name, run in named.items()}
    target = np.asarray(first.target_position)
    extent = float(np.linalg.norm(np.ptp(target, axis=0))) or 1.0
    largest = max(largest_finite(np.linalg.norm(way, axis=1)) for way in deviations.values())
    times = exaggeration
    if times is None:
        times = _round_down(min(_SEEN * extent / largest, _MOST)) if largest > 0 else 1.0
    ways = {name: named[name].target_position + times * way for name, way in deviations.items()}
    everything = np.concatenate([target, *ways.values()])
    everything = everything[np.isfinite(everything).all(axis=1)]
    pad = 0.04 * np.maximum(np.ptp(everything, axis=0), 0.02 * extent)
    low, high = everything.min(axis=0) - pad, everything.max(axis=0) + pad
    planar = float(np.ptp(everything[:, 2])) < 1e-9 * extent
    if planar:
        figure = new_figure(
            float(np.clip((WIDTH - 0.6) * (high - low)[1] / (high - low)[0], 1.2, 3.0)) + 0.75
        )
        axes = figure.subplots()
        frame_plane(axes, low, high)
    else:
        figure = new_figure(WIDTH)
        axes = figure.add_subplot(projection="3d", computed_zorder=False)
        frame_space(axes, low, high, _AZIMUTH, labelpad=-3)
        _thicken(axes, high - low)
    size = 2 if planar else 3
    handles = [Line2D([], [], **_TARGET)]
    labels = ["target"]
    axes.plot(*target.T[:size], **_TARGET, zorder=3)
    any_near = False
    for index, (name, run) in enumerate(named.items()):
        look = level_look(index)
        way = ways[name]
        any_near |= _draw_near(axes, way, run.near, size)
        axes.plot(*way.T[:size], **look, zorder=4 + index)
        _draw_instants(axes, run, way, size)
        handles.append(Line2D([], [], **look))
        labels.append(name or "tool")
    if any_near:
        handles.append(Line2D([], [], **_NEAR))
        labels.append("near singular")
    if any(len(run.singular_times) for run in named.values()):
        handles.append(Line2D([], [], **_INSTANT))
        labels.append(LEAST)
    if times != 1:
        handles.append(Line2D([], [], linestyle="none"))
        labels.append(f"(deviations × {times:g})")
    legend = legend_above(figure, handles, labels)
    if not planar:
        fill(figure, axes, legend, _TALLEST)
    return figure


def _draw_near(axes, way: np.ndarray, near: np.ndarray, size: int) -> bool:
    """Underlay the stretches of a way (k, 3) whose samples are near a singularity; whether there are any."""
    shown = np.where(near[:, None], way, np.nan)
    axes.plot(*shown.T[:size], **_NEAR, zorder=2)
    return bool(near.any())


def _draw_instants(axes, run: TrackedRun, way: np.ndarray, size: int) -> None:
    """Mark a run's singular instants on its way (k, 3)."""
    if len(run.singular_times):
        places = [np.interp(run.singular_times, run.time, line) for line in way.T[:size]]
        axes.plot(*places, **_INSTANT, zorder=20)


def _thicken(axes, spans: np.ndarray) -> None:
    """Stretch the thin sides of a box, and give each axis as many numbers as its length on the page holds."""
    sides = np.maximum(spans, _THINNEST * spans.max())
    axes.set_box_aspect(sides)
    for axis, side in zip((axes.xaxis, axes.yaxis, axes.zaxis), sides / sides.max(), strict=True):
        axis.set_major_locator(MaxNLocator(max(2, round(4 * side)), steps=[1, 2, 5, 10]))
    axes.zaxis.set_tick_params(pad=0)


def _round_down(value: float) -> float:
    """The largest of 1, 2, 5, 10, 20, ... up to a value; 1 below that."""
    if not value > 1:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(max(step * decade for step in (1, 2, 5) if step * decade <= value))
