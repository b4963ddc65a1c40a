"""All figures of a run, written to a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure
from PIL import Image

from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.viz.base import draw_base
from jffsr.viz.clearance import draw_clearance
from jffsr.viz.convergence import draw_convergence
from jffsr.viz.joints import draw_joints
from jffsr.viz.motion import draw_robot
from jffsr.viz.style import styled

if TYPE_CHECKING:
    from xarray import Dataset

# Without a date the same run gives the same bytes.
_UNDATED = {"png": {"Software": None}, "pdf": {"CreationDate": None}}
KINDS = tuple(_UNDATED)
"""The forms of a figure: to look at, and for a paper."""
_PICTURE_DPI = 160


def save_figures(
    robot: Robot, dataset: Dataset, folder: str | Path, kinds: Sequence[str] = KINDS
) -> list[Path]:
    """Write joints, base, convergence and robot as .png (200 dpi) and .pdf, or one of them, into `folder`; their paths.

    Where bodies were to keep apart there is clearance, too. dataset is a run's result.nc. The folder is made where it
    is missing. A file appears whole or not at all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "joints": draw_joints(dataset, ~robot.topology.is_revolute),
        "base": draw_base(dataset),
        "convergence": draw_convergence(dataset),
        "robot": draw_robot(robot, dataset),
    }
    if "clearance" in dataset:
        figures["clearance"] = draw_clearance(dataset)
    return [path for name, figure in figures.items() for path in save_figure(figure, folder / name, kinds)]


@styled
def save_figure(figure: Figure, stem: Path, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Write a figure to `stem`.png and `stem`.pdf, each beside its place and then moved; their paths."""
    paths = []
    for kind in kinds:
        path = stem.with_name(f"{stem.name}.{kind}")
        _whole(path, partial(figure.savefig, format=kind, metadata=_UNDATED[kind]))
        paths.append(path)
    return paths


@styled
def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure to one small .png of at most 256 colours; InputError where that cannot be written."""
    if path.suffix.lower() != ".png":
        raise InputError(f"'{path}': a picture is written as .png, found the ending '{path.suffix}'")
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=_PICTURE_DPI)
    # Maximum coverage keeps the few letters and thin lines of a colour apart from the large faces.
    picture = Image.open(buffer).convert("RGB")
    picture = picture.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    try:
        _whole(path, partial(picture.save, format="png", optimize=True))
    except OSError as error:
        raise InputError(
            f"'{path}': the picture cannot be written there ({error.strerror or error}); name another place"
        ) from None


def _whole(path: Path, write: Callable[[Path], None]) -> None:
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        write(unfinished)
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)
