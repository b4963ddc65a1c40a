"""All figures of a run, written to a folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from jffsr.robots.robot import Robot
from jffsr.viz.base import draw_base
from jffsr.viz.convergence import draw_convergence
from jffsr.viz.joints import draw_joints
from jffsr.viz.motion import draw_robot
from jffsr.viz.style import styled

if TYPE_CHECKING:
    from xarray import Dataset


def save_figures(robot: Robot, dataset: Dataset, folder: str | Path) -> list[Path]:
    """Write joints, base, convergence and robot as .png (200 dpi) and .pdf into `folder`; their paths.

    dataset is a run's result.nc. The folder is made where it is missing. A file appears whole or not at all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "joints": draw_joints(dataset, ~robot.topology.is_revolute),
        "base": draw_base(dataset),
        "convergence": draw_convergence(dataset),
        "robot": draw_robot(robot, dataset),
    }
    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name)]


@styled
def save_figure(figure: Figure, stem: Path) -> list[Path]:
    """Write a figure to `stem`.png and `stem`.pdf, each beside its place and then moved; their paths."""
    paths = []
    for kind, metadata in (("png", {"Software": None}), ("pdf", {"CreationDate": None})):
        path = stem.with_name(f"{stem.name}.{kind}")
        unfinished = stem.with_name(f".{stem.name}.{kind}.{os.getpid()}")
        try:
            # Without a date the same run gives the same bytes.
            figure.savefig(unfinished, format=kind, metadata=metadata)
            os.replace(unfinished, path)
        finally:
            unfinished.unlink(missing_ok=True)
        paths.append(path)
    return paths
