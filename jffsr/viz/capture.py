"""The figures of a capture study, from its result.nc."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from jffsr.capture.grasp_time import GraspTime, GraspTimeCode
from jffsr.capture.grasp_time_curves import GraspCandidate, GraspScan
from jffsr.robots.geometry import Geometry
from jffsr.robots.robot import Robot
from jffsr.viz.base import draw_base
from jffsr.viz.capture_front import draw_front
from jffsr.viz.capture_scene import draw_capture
from jffsr.viz.capture_tool import draw_capture_tool
from jffsr.viz.clearance import draw_clearance
from jffsr.viz.grasp_time import draw_grasp_time
from jffsr.viz.joints import draw_joints
from jffsr.viz.save import KINDS, save_figure

if TYPE_CHECKING:
    from xarray import Dataset


def save_capture_figures(
    robot: Robot,
    geometry: Geometry,
    dataset: Dataset,
    solutions: Mapping[str, Dataset],
    folder: str | Path,
    kinds: Sequence[str] = KINDS,
) -> list[Path]:
    """Write grasp_time and, where there is a plan, capture, tool, joints, base, clearance, as .png, .pdf; their paths.

    geometry holds the target's shapes in its frame of the dataset, a capture's result.nc. solutions are those chosen of
    the front, by name: front, and joints, base and tool of each. The folder is made where it is missing.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    grasped = float(dataset["time"].values[-1]) if "time" in dataset else None
    figures = {"grasp_time": draw_grasp_time(grasp_time_of(dataset), grasped)}
    if "joint_position" in dataset:
        figures["capture"] = draw_capture(robot, geometry, dataset)
        figures |= _of_motion(robot, dataset, "")
    if "clearance" in dataset:
        figures["clearance"] = draw_clearance(dataset)
    if "front_value" in dataset:
        figures["front"] = draw_front(dataset)
    for name, solution in solutions.items():
        figures |= _of_motion(robot, solution, f"{name}_")
    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name, kinds)]


def _of_motion(robot: Robot, dataset: Dataset, prefix: str) -> dict[str, Figure]:
    return {
        f"{prefix}joints": draw_joints(dataset, ~robot.topology.is_revolute),
        f"{prefix}base": draw_base(dataset),
        f"{prefix}tool": draw_capture_tool(dataset),
    }


def grasp_time_of(dataset: Dataset) -> GraspTime:
    """The criterion's curves and candidates of a capture's result.nc, by the robot's time."""
    names = [str(name) for name in dataset["grasp"].values]
    time = dataset["scan_time"].values
    scans = []
    for number, name in enumerate(names):
        curves = {
            key: dataset[variable].values[number]
            for key, variable in (
                ("value", "criterion"),
                ("distance", "grasp_distance"),
                ("facing", "grasp_facing"),
                ("share", "grasp_share"),
                ("near", "grasp_near"),
                ("feasible", "grasp_feasible"),
            )
        }
        scans.append(GraspScan(name, time, **curves, windows=np.zeros((0, 2))))
    columns = (dataset[f"candidate_{key}"].values for key in ("grasp", "time", "value", "share"))
    candidates = tuple(
        GraspCandidate(names[int(g)], float(t), float(v), float(s), False)
        for g, t, v, s in zip(*columns, strict=True)
    )
    chosen = np.flatnonzero(dataset["candidate_chosen"].values)
    return GraspTime(
        GraspTimeCode(int(dataset.attrs["grasp_time_code"])),
        str(dataset.attrs["grasp_time_sentence"]),
        candidates[chosen[0]] if len(chosen) else None,
        candidates,
        tuple(scans),
    )
