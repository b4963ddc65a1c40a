"""A robot's capability map made from the command line: its settings read, its progress shown, its file written."""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from jffsr.capture.capability_map import CapabilityMap, capability_map
from jffsr.capture.capability_map_file import save_capability_map
from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint, listed
from jffsr.robots.loading import load_robot
from jffsr.robots.robot import Robot

SETTINGS = {
    "cells": int,
    "directions": int,
    "rolls": int,
    "end_effector": str,
    "self_clearance": bool,
    "margin": float,
    "seed": int,
}


def build_map(name: str, out: str | None, overrides: Sequence[str]) -> tuple[Robot, CapabilityMap, Path]:
    """Search the map of a robot, a catalogue name or a file, and write it to `out`, NAME_map.nc by default.

    overrides are texts key=value of `SETTINGS`. What is searched is kept beside the file until it is finished, and the
    same command goes on from there. Raises InputError for other keys and values, and where the file is there already.
    """
    robot, settings = load_robot(name), read_settings(overrides)
    path = Path(out if out is not None else re.sub(r"[^\w.-]", "_", robot.name) + "_map.nc")
    if path.exists():
        raise InputError(f"{path}: the file is there already; delete it or give another with --out")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder '{path.parent}'")
    part = path.with_name(f"{path.name}.part")
    from tqdm import tqdm

    shown = sys.stderr.isatty()
    with tqdm(unit="cell", disable=not shown, file=sys.stderr, smoothing=0.1) as bar:

        def progress(done: int, cells: int) -> None:
            bar.total = cells
            bar.update(done - bar.n)

        capability = capability_map(robot, **settings, checkpoint=part, progress=progress)
    save_capability_map(capability, path)
    part.unlink(missing_ok=True)
    return robot, capability, path


def read_settings(overrides: Sequence[str]) -> dict[str, Any]:
    """The settings of texts key=value; InputError for what is none."""
    found = {}
    for text in overrides:
        key, equals, value = text.partition("=")
        if not equals or key not in SETTINGS:
            raise InputError(
                f"'{text[:80]}': KEY=VALUE with one of {listed(SETTINGS)} is expected{hint(key, SETTINGS)}"
            )
        kind = SETTINGS[key]
        try:
            read = yaml.safe_load(value)
        except yaml.YAMLError:
            read = None
        if kind is float and type(read) is int:
            read = float(read)
        if type(read) is not kind:
            words = {int: "a whole number", float: "a number", bool: "true or false", str: "a name"}[kind]
            raise InputError(f"'{text[:80]}': {words} is expected for {key}")
        found[key] = read
    return found


def map_text(capability: CapabilityMap, path: Path) -> str:
    """What a map says in short, and where it is."""
    share, spacing = capability.share, float(capability.spacing)
    reached = int((share > 0).sum())
    layer = 1 in share.shape
    size = f"{reached * spacing**2:.4g} m^2" if layer else f"{reached * spacing**3:.4g} m^3"
    return (
        f"{capability.robot}: {reached} cells of {100 * spacing:.3g} cm, {size}, can be reached in some of "
        f"{capability.direction.shape[0] * capability.rolls} attitudes, at best in {100 * share.max():.3g} % of them\n"
        f"  map     {path}"
    )
