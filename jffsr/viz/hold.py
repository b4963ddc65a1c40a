"""A base that is held still while the arm takes up momentum: the base, the joints and their torques over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.crosscheck.compare import attitude_difference
from jffsr.viz.style import COLOURS, GREY, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

WINDOW = 1.0  # s, over which a root mean square is taken
_LEAST = 1e-12  # rad/s, what a logarithmic axis shows of no motion at all


@styled
def draw_hold(
    dataset: Dataset,
    allowed: float | None = None,
    grasp: float | None = None,
    prismatic: np.ndarray | None = None,
) -> Figure:
    """Four panels over time: the base's rate and its running root mean square, its turn, joint rates, torques.

    dataset is a hold.nc, or a chain's result.nc; allowed, rad/s, and the time of the grasp, s, are marked. prismatic
    (n,): which joints slide; theirs are in m/s and N.
    """
    names = [str(name) for name in dataset["joint"].values]
    time = dataset["time"].values
    slides = np.zeros(len(names), bool) if prismatic is None else np.asarray(prismatic, bool)
    figure = new_figure(5.2 + 0.05 * len(names))
    panels = figure.subplots(4, sharex=True)
    spin = np.linalg.norm(dataset["base_twist"].values[:, 3:], axis=1)
    panels[0].plot(time, np.rad2deg(np.maximum(spin, _LEAST)), color=COLOURS[6], linewidth=0.5)
    smooth = running_rms(time, spin, WINDOW)
    panels[0].plot(time, np.rad2deg(np.maximum(smooth, _LEAST)), color=COLOURS[1])
    panels[0].set(yscale="log", ylabel="base rate [deg/s]")
    moving = smooth[smooth > _LEAST]
    if moving.size:
        panels[0].set_ylim(bottom=np.rad2deg(0.3 * moving.min()))
    if allowed is not None:
        panels[0].axhline(np.rad2deg(allowed), color=GREY, linestyle=(0, (4, 2)), linewidth=0.7)
    panels[1].plot(time, np.rad2deg(turned_by(dataset["base_quaternion"].values)), color=COLOURS[1])
    panels[1].set_ylabel("base turned by [deg]")
    scale = np.where(slides, 1.0, 180 / np.pi)
    _curves(panels[2], time, scale * dataset["joint_velocity"].values)
    panels[2].set_ylabel(_unit("joint rate [deg/s]", "joint rate [m/s]", slides))
    _curves(panels[3], time, dataset["joint_torque"].values)
    panels[3].set(ylabel=_unit("torque [N m]", "force [N]", slides), xlabel="time [s]")
    for axes in panels:
        axes.margins(x=0)
        if grasp is not None:
            axes.axvline(grasp, color=GREY, linewidth=0.8, linestyle=(0, (1, 1.5)), gid="grasp")
    figure.align_ylabels()
    handles = [Line2D([], [], **line_look(joint)) for joint in range(len(names))]
    labels = list(names)
    if allowed is not None:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (4, 2)), linewidth=0.7))
        labels.append("allowed")
    if grasp is not None:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (1, 1.5)), linewidth=0.8))
        labels.append("grasp")
    legend_above(figure, handles, labels)
    return figure


def turned_by(quaternion: np.ndarray) -> np.ndarray:
    """Angles (K,), rad, from the first of attitudes (K, 4)."""
    return attitude_difference(quaternion, quaternion[:1])


def running_rms(time: np.ndarray, values: np.ndarray, width: float) -> np.ndarray:
    """Root mean square of values (N, ...) over a window of `width`, s, about each sample; shorter at the ends.

    What crosses zero again and again cannot be read on a logarithmic axis as it is.
    """
    half = max(1, round(0.5 * width / (time[-1] - time[0]) * (len(time) - 1)))
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values**2, axis=0)])
    place = np.arange(len(time))
    first, last = np.maximum(place - half, 0), np.minimum(place + half + 1, len(time))
    count = (last - first).reshape(-1, *(1,) * (values.ndim - 1))
    # Differences of sums that grow may fall below zero by rounding.
    return np.sqrt(np.maximum(total[last] - total[first], 0.0) / count)


def _curves(axes: Axes, time: np.ndarray, values: np.ndarray) -> None:
    for joint, curve in enumerate(values.T):
        axes.plot(time, curve, **line_look(joint))


def _unit(turning: str, sliding: str, slides: np.ndarray) -> str:
    if slides.all():
        return sliding
    return f"{turning.removesuffix(']')}, {sliding[sliding.index('[') + 1 :]}" if slides.any() else turning
