"""The pictures of the page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.wu_2018.front import PAIRS
from jffsr.viz.save import save_figure
from jffsr.viz.style import legend_above, line_look, new_figure, styled
from jffsr.viz.tracked_run import tracked_run
from jffsr.viz.tracking import draw_singular_values, draw_tracked_joints

_WIDE = 7.2  # in


def draw_all(stem: Path, found: Mapping[str, Any]) -> None:
    """Every picture as PNG beside the page, its name the page's with a word more."""
    robot, runs = found["robot"], found["runs"]

    def saved(figure: Figure, word: str) -> None:
        save_figure(figure, stem.with_name(f"{stem.name}_{word}"), ("png",))

    def named(momentum: str, duration: float) -> dict:
        return {
            method: tracked_run(runs[duration, momentum, method][0], robot)
            for method in ("inverse", "damped", "adaptive")
        }

    at_singularity = {
        f"{duration:g} s, {momentum} momentum": tracked_run(runs[duration, momentum, "adaptive"][0], robot)
        for duration in (15.0, 25.0)
        for momentum in ("zero", "given")
    }
    saved(draw_singular_values(at_singularity), "singular_values")
    for duration in (25.0, 15.0):
        saved(draw_tracked_joints(named("zero", duration)), f"joints_{duration:g}s")
    saved(_errors(runs), "errors")
    saved(_generations(found["searches"]), "generations")
    saved(_winner(found["freedoms"]), "refined")
    saved(_front(found["front"], found["peak"]), "front")


@styled
def _errors(runs: Mapping) -> Figure:
    """Errors in six directions, damped and adaptive, both durations: the paper's Fig. 11."""
    figure = new_figure(5.2, _WIDE)
    panels = figure.subplots(4, 3, sharex=False)
    for half, duration in enumerate((25.0, 15.0)):
        for index, axes in enumerate(panels[2 * half : 2 * half + 2].ravel()):
            for look, method in enumerate(("damped", "adaptive")):
                found = runs[duration, "zero", method][1]
                factor = 1e3 if index < 3 else 180 / np.pi
                axes.plot(found.time, factor * found.errors[:, index], **line_look(look), label=method)
            axes.axhline(0, color="0.7", linewidth=0.5, zorder=0)
            axes.set_xlim(0, duration)
            direction = "xyz"[index % 3]
            words = f"{direction} [mm]" if index < 3 else f"about {direction} [deg]"
            axes.set_title(f"{words}, {duration:g} s", pad=2)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    legend_above(figure, panels[0, 0].lines[:2], ["damped", "adaptive"])
    return figure


@styled
def _generations(searches: Mapping[float, Mapping]) -> Figure:
    """Best and mean of each generation: the paper's Fig. 7."""
    figure = new_figure(2.4, _WIDE)
    panels = figure.subplots(1, len(searches))
    for axes, (duration, found) in zip(panels, searches.items(), strict=True):
        generation = np.arange(1, len(found["best"]) + 1)
        axes.semilogy(generation, found["best"], **line_look(0), label="best")
        axes.semilogy(generation, found["mean"], **line_look(1), label="mean, broken limits weighed in")
        axes.set_title(f"{duration:g} s, rates up to {found['limit']:.3g} deg/s")
        axes.set_xlabel("generation")
    panels[0].set_ylabel("index with penalty")
    legend_above(figure, panels[0].lines, [line.get_label() for line in panels[0].lines])
    return figure


@styled
def _winner(rows: Mapping[float, list]) -> Figure:
    """Position and attitude error over time, the largest while a rate is held, in logarithms."""
    figure = new_figure(4.0, _WIDE)
    panels = figure.subplots(2, len(rows), sharey="row", sharex="col", squeeze=False)
    shown = ("none", "rates", "posture", "posture and feedback", "posture, feedback and rates")
    for column, (duration, found) in enumerate(rows.items()):
        chosen = {row.freedom: row.measured for row in found if row.freedom in shown}
        for look, (name, measured) in enumerate(chosen.items()):
            position, attitude = (_envelope(measured.errors[:, part]) for part in (slice(0, 3), slice(3, 6)))
            time = np.linspace(0, duration, len(position) + 1)
            label = "published method" if name == "none" else name
            for axes, curve in zip(panels[:, column], (1e3 * position, np.rad2deg(attitude)), strict=True):
                axes.stairs(curve, time, baseline=None, **line_look(look), label=label)
                axes.set_yscale("log")
        panels[0, column].set_title(f"{duration:g} s, all within {found[0].measured.peak:.2f} deg/s")
        panels[0, column].set_ylim(1e-2, 30)
        panels[1, column].set_ylim(2e-5, 5)
        panels[1, column].set_xlim(0, duration)
        panels[1, column].set_xlabel("time [s]")
    panels[0, 0].set_ylabel("position error [mm]")
    panels[1, 0].set_ylabel("attitude error [deg]")
    figure.align_ylabels()
    handles, labels = panels[0, 0].get_legend_handles_labels()
    legend_above(figure, handles, labels)
    return figure


def _envelope(errors: np.ndarray) -> np.ndarray:
    """The largest length of errors (8 K + 1, 3) while each of the K rates is held."""
    size = np.linalg.norm(errors, axis=1)
    inside = size[:-1].reshape(-1, 8)
    return np.maximum(inside.max(axis=1), size[8::8])


@styled
def _front(curves: Mapping[str, np.ndarray], peak: float) -> Figure:
    """Error over the published method's against peak rate."""
    figure = new_figure(3.2, 5.0)
    axes = figure.subplots()
    for look, (name, (peaks, errors)) in enumerate(curves.items()):
        marker = {"marker": "o", "markersize": 2.5}
        if name == PAIRS:
            axes.semilogy(peaks, errors, ".", color="0.6", markersize=2, label=name, zorder=1)
            continue
        axes.semilogy(peaks, np.maximum(errors, 1e-4), **line_look(look), **marker, label=name)
    axes.plot([peak], [1.0], linestyle="none", marker="*", markersize=7, color="black", label="printed pair")
    axes.axhline(0.1, color="0.6", linewidth=0.6, zorder=0)
    axes.annotate("a tenth", (11.9, 0.1), ha="right", va="bottom", fontsize=6, color="0.3")
    axes.set_xlim(2.5, 12)
    axes.set_ylim(3e-3, 6)
    axes.set_xlabel("largest joint rate [deg/s]")
    axes.set_ylabel("error over that of the printed pair")
    shown = axes.lines[: len(curves) + 1]
    legend_above(figure, shown, [line.get_label() for line in shown])
    return figure
