"""Figures inside a page: as few bytes as they can be read with."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape
from pathlib import Path

from PIL import Image

_CAPTIONS = {
    "base": "attitude and place of the base",
    "boxes": "what each setting found, over its seeds",
    "capture": "robot and target at the start, half way, and at the grasp",
    "clearance": "distances of the bodies that come nearest",
    "convergence": "best value so far, over what was spent",
    "front": "what can be had for what: the solutions that nothing beats in both indices",
    "grasp_time": "when to grasp: the criterion over time",
    "joints": "joints: position, rate, acceleration, and their limits",
    "map": "median over two keys; in each cell the share of points that met their accuracy",
    "observation": "what the camera saw, and what the filter made of it",
    "robot": "the arm at five instants",
    "tool": "the tool beside the grasp frame",
}
_COLOURS = 48
_WIDEST = 900  # pixels


def figures_block(files: Sequence[Path]) -> str:
    """The pictures (.png) among `files`, each under its name; nothing where there are none."""
    shown = [_figure(file) for file in files if file.suffix == ".png"]
    return f'<div class="figures">{"".join(shown)}</div>' if shown else ""


def _figure(file: Path) -> str:
    with Image.open(file) as picture:
        picture = picture.convert("RGB")
        if picture.width > _WIDEST:
            height = round(picture.height * _WIDEST / picture.width)
            picture = picture.resize((_WIDEST, height), Image.Resampling.LANCZOS)
        width, height = picture.size
        buffer = io.BytesIO()
        picture.quantize(_COLOURS, dither=Image.Dither.NONE).save(buffer, format="png", optimize=True)
    name = escape(_CAPTIONS.get(file.stem, file.stem.replace("_", " ")))
    data = base64.b64encode(buffer.getvalue()).decode("ascii")
    return (
        f'<figure><img alt="{name}" width="{width}" height="{height}" src="data:image/png;base64,{data}">'
        f"<figcaption>{name}</figcaption></figure>"
    )
