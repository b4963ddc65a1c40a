"""The figures of a chain: those of its plan, what the camera made of the target, and the motion to the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.viz.capture import save_capture_figures
from jffsr.viz.hold import draw_hold
from jffsr.viz.save import KINDS, save_figure
from jffsr.viz.style import line_look, new_figure, styled

if TYPE_CHECKING:
    from xarray import Dataset


def save_chain_figures(
    robot: Robot,
    geometry: Geometry,
    plan: Dataset,
    observation: Dataset,
    dataset: Dataset,
    allowed: float,
    folder: str | Path,
    kinds: Sequence[str] = KINDS,
) -> list[Path]:
    """Write the capture's figures, and observation and, where it was carried out, chain, as .png and .pdf; their paths.

    plan, observation and dataset are a chain's plan.nc, observation.nc and result.nc; geometry, the target's shapes;
    allowed, rad/s, the base's rate at the end.
    """
    folder = Path(folder)
    paths = save_capture_figures(robot, geometry, plan, {}, folder, kinds)
    figures = {"observation": draw_observation(observation)}
    if "stage" in dataset:
        stage, time = dataset["stage"].values, dataset["time"].values
        grasp = float(time[stage == 0][-1]) if np.any(stage == 1) else None
        prismatic = ~robot.topology.is_revolute
        figures["chain"] = draw_hold(dataset, allowed, grasp, prismatic)
    return paths + [
        path for name, figure in figures.items() for path in save_figure(figure, folder / name, kinds)
    ]


@styled
def draw_observation(observation: Dataset) -> Figure:
    """Three panels over the robot's time: the poses' distance from the estimate, angular velocity, and deviations."""
    figure = new_figure(4.2)
    panels = figure.subplots(3, sharex=True)
    time = observation["filter_time"].values
    measured = observation.sel(time=time, method="nearest")
    seen, used = measured["seen"].values.astype(bool), observation["used"].values.astype(bool)
    off = np.linalg.norm(measured["measured_position"].values - observation["marker_position"].values, axis=1)
    for number, (chosen, label, mark) in enumerate(
        ((seen & used, "used", "."), (seen & ~used, "refused by the gate", "x"))
    ):
        look = line_look(number) | {"linestyle": "none"}
        panels[0].plot(time[chosen], 1e3 * off[chosen], marker=mark, markersize=2.5, label=label, **look)
    panels[0].set(ylabel="pose off by [mm]", yscale="log")
    panels[0].legend(ncols=2, loc="upper right")
    rate = np.rad2deg(observation["angular_velocity"].values)
    for axis, name in enumerate("xyz"):
        panels[1].plot(time, rate[:, axis], label=f"$\\omega_{name}$", **line_look(axis))
    panels[1].set_ylabel("rate [deg/s]")
    panels[1].legend(ncols=3, loc="upper right")
    deviation = observation["deviation"].values
    parts = (
        (slice(0, 3), 180 / np.pi, "attitude, deg"),
        (slice(3, 6), 180 / np.pi, "rate, deg/s"),
        (slice(11, 14), 1e3, "position, mm"),
    )
    for number, (part, scale, label) in enumerate(parts):
        size = scale * np.linalg.norm(deviation[:, part], axis=1)
        panels[2].plot(time, size, label=label, **line_look(number))
    panels[2].set(ylabel="deviation", yscale="log", xlabel="time [s]")
    panels[2].legend(ncols=3, loc="upper right")
    for axes in panels:
        axes.margins(x=0)
        # Room for the legend above the curves.
        axes.margins(y=0.25)
    figure.align_ylabels()
    return figure
