"""What is to be said of a sweep that came to its end: its summary, also where points of it could not be computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from jffsr.errors import InputError
from jffsr.planning.result import ResultCode
from jffsr.study.dataset import open_dataset
from jffsr.study.summary import versions
from jffsr.study.sweep.best import find_best
from jffsr.study.sweep.folder import SweepFolder
from jffsr.study.sweep.merging import FAILURE, MISSING
from jffsr.study.sweep.specification import read_sweep

UNKNOWN = "not recorded"


def summary_of(dataset: Any, name: str) -> dict[str, Any]:
    """The summary of a merged sweep, plain data."""
    code = dataset["code"].values
    failed = failures_of(dataset)
    met = int(np.count_nonzero(code == ResultCode.ACCURACY_MET))
    best = find_best(dataset)
    lost = f"; {len(failed)} could not be computed" if failed else ""
    return {
        "kind": "sweep",
        "name": name,
        "result": {
            "code": int(met < code.size),
            "sentence": f"{met} of {code.size} points met their accuracy{lost}",
        },
        "points": int(code.size),
        "computed": int(code.size - len(failed)),
        "met": met,
        "best_setting": None if best is None else best.sentence,
        "fell_short": {
            kind.name.lower(): count
            for kind in ResultCode
            if kind is not ResultCode.ACCURACY_MET and (count := int(np.count_nonzero(code == kind)))
        },
        "failures": _grouped(failed),
        "evaluations": {
            "objective": int(dataset["evaluations"].values.sum()),
            "gradient": int(dataset["gradient_evaluations"].values.sum()),
        },
        "versions": versions(),
    }


def outcome_lines(summary: Mapping[str, Any]) -> list[str]:
    """What is printed under a sweep's table: how many points met, the best setting, the codes of the others."""
    lines = [f"{summary['name']}: {summary['result']['sentence']}"]
    if best := summary.get("best_setting"):
        lines.append(f"  best    {best}")
    if short := summary.get("fell_short"):
        kinds = ", ".join(f"{count} {kind.replace('_', ' ')}" for kind, count in short.items())
        lines.append(f"  short   {kinds}; jffsr show with --report says why")
    return lines


def failures_of(dataset: Any) -> dict[int, str]:
    """Numbers of the points that could not be computed, each with its reason."""
    reasons = dataset[FAILURE].values if FAILURE in dataset else None
    return {
        int(point): (str(reasons[point]) if reasons is not None else "") or UNKNOWN
        for point in np.flatnonzero(dataset["code"].values == MISSING)
    }


def read_ended(path: str | Path) -> dict[str, Any]:
    """The summary of a sweep that came to its end; InputError where it is under way, or there is none.

    With points that could not be computed a sweep has no summary.json, so that its command tries them again: then
    what is said comes from sweep.nc.
    """
    folder = SweepFolder(Path(path))
    if folder.finished or not folder.result.is_file():
        return folder.read_summary()
    name = read_sweep(str(folder.config)).name
    try:
        return summary_of(open_dataset(folder.result), name)
    except Exception as error:
        raise InputError(f"{folder.result}: cannot be read ({error})") from None


def _grouped(failed: Mapping[int, str]) -> list[str]:
    """A line for each reason, with the points that it stopped."""
    groups: dict[str, list[int]] = {}
    for point, reason in failed.items():
        groups.setdefault(reason, []).append(point)
    return [f"{_points(points)}: {reason}" for reason, points in groups.items()]


def _points(points: list[int]) -> str:
    if len(points) == 1:
        return f"point {points[0]}"
    shown = ", ".join(map(str, points[:8]))
    return f"points {shown}" + (f" and {len(points) - 8} more" if len(points) > 8 else "")
