"""The figures of a sweep, from its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jffsr.errors import InputError
from jffsr.study.dataset import open_dataset
from jffsr.study.sweep.folder import SweepFolder
from jffsr.viz.save import KINDS, save_figure
from jffsr.viz.sweep_boxes import draw_boxes
from jffsr.viz.sweep_convergence import draw_sweep_convergence
from jffsr.viz.sweep_map import draw_map


def draw_sweep(path: str | Path, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Draw what a sweep found into its folder: boxes over seeds, a map over two keys, convergence; their files.

    A figure that the sweep has no use for is left out. kinds are of "png" and "pdf". InputError where there is no
    sweep.nc or it cannot be read.
    """
    folder = SweepFolder(Path(path))
    try:
        dataset = open_dataset(folder.result)
    except Exception as error:
        raise InputError(f"{folder.result}: cannot be read ({error})") from None
    figures = {
        "boxes": draw_boxes(dataset),
        "map": draw_map(dataset),
        "convergence": draw_sweep_convergence(dataset),
    }
    try:
        folder.figures.mkdir(exist_ok=True)
        return [
            file
            for name, figure in figures.items()
            if figure is not None
            for file in save_figure(figure, folder.figures / name, kinds)
        ]
    except OSError as error:
        raise InputError(f"{folder.figures}: cannot be written ({error.strerror or error})") from None
