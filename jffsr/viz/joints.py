"""Joint positions, rates and accelerations over time, with the limits that are near."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jffsr.viz.limits import frame_curves
from jffsr.viz.style import GREY, legend_above, line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset

_REVOLUTE = (
    ("joint angle [deg]", "joint_position"),
    ("rate [deg/s]", "joint_velocity"),
    ("acceleration [deg/s²]", "joint_acceleration"),
    ("torque [N m]", "joint_torque"),
)
_PRISMATIC = (
    ("joint travel [m]", "joint_position"),
    ("rate [m/s]", "joint_velocity"),
    ("acceleration [m/s²]", "joint_acceleration"),
    ("force [N]", "joint_torque"),
)


@styled
def draw_joints(dataset: Dataset, prismatic: Sequence[bool] | None = None) -> Figure:
    """Three stacked panels of a run's joint motion: angles in deg, rates and accelerations; a fourth of its torques.

    dataset is a run's result.nc; `prismatic` (n,) says which joints slide (none): they get three panels of
    their own, in m. Limits that the curves come near are dashed, and the panel is shaded beyond those that
    all joints share.
    """
    names = [str(name) for name in dataset["joint"].values]
    slides = np.zeros(len(names), bool) if prismatic is None else np.asarray(prismatic, bool)
    groups = [
        (np.flatnonzero(chosen), factor, rows)
        for chosen, factor, rows in ((~slides, 180 / np.pi, _REVOLUTE), (slides, 1.0, _PRISMATIC))
        if chosen.any()
    ]
    panels = [
        (joints, 1.0 if variable == "joint_torque" else factor, (label, variable))
        for joints, factor, rows in groups
        for label, variable in rows
        if variable in dataset
    ]
    figure = new_figure(0.45 + 0.05 * len(names) + 1.15 * len(panels))
    all_axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
    time, near = dataset["time"].values, False
    for axes, (joints, factor, (label, variable)) in zip(all_axes, panels, strict=True):
        values = factor * dataset[variable].values[:, joints]
        for joint, curve in zip(joints, values.T, strict=True):
            axes.plot(time, curve, **line_look(joint))
        lower, upper = (factor * limit[joints] for limit in _limits(dataset, variable))
        near |= frame_curves(axes, values, lower, upper, [names[joint] for joint in joints])
        axes.set_ylabel(label)
        axes.margins(x=0)
    all_axes[-1].set_xlabel("time [s]")
    figure.align_ylabels()
    handles = [Line2D([], [], **line_look(joint)) for joint in range(len(names))]
    if near:
        handles.append(Line2D([], [], color=GREY, linestyle=(0, (4, 2)), linewidth=0.7))
    legend_above(figure, handles, [*names, "limit"][: len(handles)])
    return figure


def _limits(dataset: Dataset, variable: str) -> tuple[np.ndarray, np.ndarray]:
    if variable == "joint_position":
        return dataset[f"{variable}_lower"].values, dataset[f"{variable}_upper"].values
    limit = dataset[f"{variable}_limit"].values
    return -limit, limit
