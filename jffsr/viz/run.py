"""The figures of a finished run, from its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jffsr.study.reviewing import open_run
from jffsr.viz.save import KINDS, save_figures


def draw_run(path: str | Path, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Draw the figures of a finished run into its folder and return their files; InputError if it is none.

    kinds are of "png" and "pdf".
    """
    folder, problem, dataset = open_run(path)
    return save_figures(problem.robot, dataset, folder.figures, kinds)
