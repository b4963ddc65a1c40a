"""Tracked motions over time: pose errors, singular values and determinant, joints; several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter

from jffsr.viz.save import KINDS, save_figure
from jffsr.viz.style import GREY, legend_above, line_look, styled
from jffsr.viz.tracked_run import Runs, TrackedRun, runs_by_name
from jffsr.viz.tracking_panels import frame_row, largest_finite, mark_handles, new_panels
from jffsr.viz.tracking_path import draw_tool_path

_LIMIT = {"color": GREY, "linestyle": (0, (4, 2)), "linewidth": 0.7}
# Singular values are drawn down to this share of the largest: a zero has no logarithm.
_LEAST = 1e-5


@styled
def draw_pose_errors(runs: Runs) -> Figure:
    """Errors of the tool's pose in six directions of I: position, mm (m from 0.2 m on), and rotation vector, deg."""
    named = runs_by_name(runs)
    figure, panels = new_panels(2, named, 3.2)
    largest = max(largest_finite(np.abs(run.error[:, :3])) for run in named.values())
    small = bool(largest < 0.2)
    rows = ((slice(0, 3), 1e3 if small else 1.0), (slice(3, 6), 180 / np.pi))
    for axes_row, (part, factor) in zip(panels, rows, strict=True):
        curves = [factor * np.asarray(run.error)[:, part] for run in named.values()]
        for axes, run, values in zip(axes_row, named.values(), curves, strict=True):
            for index, curve in enumerate(values.T):
                axes.plot(run.time, curve, **line_look(index))
        frame_row(axes_row, curves, *2 * [np.full(3, np.inf)], "xyz", usual=np.median)
    panels[0, 0].set_ylabel(f"position error [{'mm' if small else 'm'}]")
    panels[1, 0].set_ylabel("attitude error [deg]")
    _finish(figure, [Line2D([], [], **line_look(index)) for index in range(3)], list("xyz"), named)
    return figure


@styled
def draw_singular_values(runs: Runs) -> Figure:
    """Singular values of the generalized Jacobian, in logarithms, with the threshold; and its determinant if square."""
    named = runs_by_name(runs)
    square = all(run.determinant is not None for run in named.values())
    figure, panels = new_panels(1 + square, named, 3.3 if square else 2.2)
    largest = max(largest_finite(run.singular_values) for run in named.values()) or 1.0
    smallest = -max(largest_finite(-np.asarray(run.singular_values)) for run in named.values())
    low = max(0.6 * smallest, _LEAST * largest)
    for axes, run in zip(panels[0], named.values(), strict=True):
        for index, curve in enumerate(np.asarray(run.singular_values).T):
            axes.semilogy(run.time, np.maximum(curve, _LEAST * largest), **line_look(index))
        axes.axhline(run.level, **_LIMIT, zorder=1, gid="threshold")
    panels[0, 0].set_ylim(low, 1.6 * largest)
    panels[0, 0].yaxis.set_major_locator(LogLocator(numticks=6))
    panels[0, 0].yaxis.set_minor_formatter(NullFormatter())
    panels[0, 0].set_ylabel("singular value [m]")
    if square:
        for axes, run in zip(panels[1], named.values(), strict=True):
            axes.axhline(0.0, color=GREY, linewidth=0.5, zorder=1)
            axes.plot(run.time, run.determinant, **line_look(0))
        panels[1, 0].set_ylabel("determinant")
    count = max(run.singular_values.shape[1] for run in named.values())
    handles = [*(Line2D([], [], **line_look(index)) for index in range(count)), Line2D([], [], **_LIMIT)]
    labels = [*(f"$\\sigma_{index + 1}$" for index in range(count)), "threshold"]
    _finish(figure, handles, labels, named)
    return figure


@styled
def draw_tracked_joints(runs: Runs) -> Figure:
    """Joint angles, deg, and rates, deg/s, with the limits that are near; sliding joints in m on rows of their own.

    Names and limits are those of the first run.
    """
    named = runs_by_name(runs)
    first = next(iter(named.values()))
    names, slides = first.names, first.slides
    groups = ((~slides, 180 / np.pi, ("joint angle [deg]", "rate [deg/s]")),)
    groups += ((slides, 1.0, ("joint travel [m]", "rate [m/s]")),)
    rows = [
        (np.flatnonzero(chosen), factor, label, variable)
        for chosen, factor, labels in groups
        if chosen.any()
        for label, variable in zip(labels, ("joint_position", "joint_velocity"), strict=True)
    ]
    figure, panels = new_panels(len(rows), named, 0.7 + 1.3 * len(rows))
    near = False
    for axes_row, (joints, factor, label, variable) in zip(panels, rows, strict=True):
        curves = [factor * np.asarray(getattr(run, variable))[:, joints] for run in named.values()]
        for axes, run, values in zip(axes_row, named.values(), curves, strict=True):
            for joint, curve in zip(joints, values.T, strict=True):
                axes.plot(run.time, curve, **line_look(joint), **_stairs(variable))
        lower, upper = (factor * limit[joints] for limit in first.limits(variable))
        near |= frame_row(axes_row, curves, lower, upper, [names[joint] for joint in joints])
        axes_row[0].set_ylabel(label)
    handles = [Line2D([], [], **line_look(joint)) for joint in range(len(names))]
    if near:
        handles.append(Line2D([], [], **_LIMIT))
    _finish(figure, handles, [*names, "limit"][: len(handles)], named)
    return figure


def _stairs(variable: str) -> dict:
    """Rates are held from each sample to the next."""
    return {"drawstyle": "steps-post"} if variable == "joint_velocity" else {}


def _finish(figure: Figure, handles: list, labels: list[str], named: dict[str, TrackedRun]) -> None:
    figure.align_ylabels()
    more, words = mark_handles(list(named.values()))
    legend_above(figure, [*handles, *more], [*labels, *words])


def save_tracking_figures(runs: Runs, folder: str | Path, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Write tool_path, pose_errors, singular_values and tracked_joints as .png and .pdf, or one of them; their paths.

    The folder is made where it is missing. A file appears whole or not at all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "tool_path": draw_tool_path(runs),
        "pose_errors": draw_pose_errors(runs),
        "singular_values": draw_singular_values(runs),
        "tracked_joints": draw_tracked_joints(runs),
    }
    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name, kinds)]
