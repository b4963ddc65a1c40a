"""The figures of a reactionless study and of a chain, from their datasets."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.robots.robot import Robot
from jffsr.viz.hold import WINDOW, draw_hold, running_rms, turned_by
from jffsr.viz.save import KINDS, save_figure
from jffsr.viz.style import legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_LEAST = 1e-12  # rad/s and rad, what a logarithmic axis shows of nothing


def save_reactionless_figures(
    robot: Robot, dataset: Dataset, allowed: float, folder: str | Path, kinds: Sequence[str] = KINDS
) -> list[Path]:
    """Write base, tracking, momentum, and the hold of every run, as .png and .pdf; their paths.

    dataset is a reactionless study's result.nc; allowed, rad/s, the base's rate at the end.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    prismatic = ~robot.topology.is_revolute
    figures = {
        "base": draw_bases(dataset),
        "tracking": draw_errors(dataset, prismatic),
        "momentum": draw_momentum(dataset),
    }
    for name in dataset["run"].values:
        part = re.sub(r"[^A-Za-z0-9]+", "_", str(name)).strip("_")
        figures[f"hold_{part}"] = draw_hold(dataset.sel(run=name), allowed, prismatic=prismatic)
    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name, kinds)]


@styled
def draw_bases(dataset: Dataset) -> Figure:
    """Two panels over time, a line each run: how far the base has turned, and its rate (running root mean square)."""
    names = [str(name) for name in dataset["run"].values]
    figure = new_figure(2.6 + 0.16 * len(names))
    panels = figure.subplots(2, sharex=True)
    time = dataset["time"].values
    for number in range(len(names)):
        turned = turned_by(dataset["base_quaternion"].values[number])
        spin = running_rms(time, np.linalg.norm(dataset["base_twist"].values[number, :, 3:], axis=1), WINDOW)
        panels[0].plot(time, np.rad2deg(turned), **line_look(number))
        panels[1].plot(time, np.rad2deg(np.maximum(spin, _LEAST)), **line_look(number))
    panels[0].set_ylabel("base turned by [deg]")
    panels[1].set(ylabel="base rate [deg/s]", yscale="log", xlabel="time [s]")
    for axes in panels:
        axes.margins(x=0)
    figure.align_ylabels()
    _legend(figure, names)
    return figure


@styled
def draw_errors(dataset: Dataset, prismatic: Sequence[bool]) -> Figure:
    """A panel for each joint: its position error (running root mean square) over time, a line each run."""
    names = [str(name) for name in dataset["run"].values]
    joints = [str(name) for name in dataset["joint"].values]
    figure = new_figure(0.5 + 0.16 * len(names) + 0.95 * len(joints))
    panels = figure.subplots(len(joints), sharex=True, squeeze=False)[:, 0]
    time = dataset["time"].values
    error = dataset["joint_position"].values - dataset["desired_position"].values
    for joint, axes in enumerate(panels):
        scale, unit = (1.0, "m") if prismatic[joint] else (180 / np.pi, "deg")
        for number in range(len(names)):
            size = running_rms(time, error[number, :, joint], WINDOW)
            axes.plot(time, scale * np.maximum(size, _LEAST), **line_look(number))
        axes.set(ylabel=f"{joints[joint]} [{unit}]", yscale="log")
        axes.margins(x=0)
    panels[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    _legend(figure, names)
    return figure


@styled
def draw_momentum(dataset: Dataset) -> Figure:
    """Angular momentum about the whole's centre of mass over time, in the first run, and how far it drifts in all."""
    names = [str(name) for name in dataset["run"].values]
    figure = new_figure(2.6 + 0.16 * len(names))
    panels = figure.subplots(2, sharex=True)
    time, angular = dataset["time"].values, dataset["momentum"].values[..., 3:]
    for axis, name in enumerate("xyz"):
        panels[0].plot(time, angular[0, :, axis], label=f"$L_{name}$", **line_look(axis))
    panels[0].set_ylabel("momentum [N m s]")
    panels[0].legend(ncols=3)
    for number in range(len(names)):
        drift = np.linalg.norm(angular[number] - angular[number, 0], axis=1)
        panels[1].plot(time[1:], np.maximum(drift[1:], 1e-16), **line_look(number))
    panels[1].set(ylabel="change [N m s]", yscale="log", xlabel="time [s]")
    for axes in panels:
        axes.margins(x=0)
    figure.align_ylabels()
    _legend(figure, names)
    return figure


def _legend(figure: Figure, names: Sequence[str]) -> None:
    legend_above(figure, [Line2D([], [], **line_look(k)) for k in range(len(names))], list(names))
