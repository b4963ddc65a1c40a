"""All parts of a sweep as one labelled data set, which xarray and any reader of netCDF can open."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.dataset import save_dataset
from jffsr.study.sweep.compute import OVERRUN
from jffsr.study.sweep.misses import merged_misses
from jffsr.study.sweep.parts import Part
from jffsr.study.sweep.points import Point, value_text

MISSING = -1
"""The code of a point that could not be computed."""
FAILURE = "failure"
"""The variable that says why, empty for all other points; it is there only where some point could not be computed."""

_UNITS = {
    "code": ("1", "result code"),
    "cost": ("1", "published index"),
    "cost_finer": ("1", "published index of the finer re-run"),
    "evaluations": ("1", "objective evaluations"),
    "gradient_evaluations": ("1", "gradient evaluations"),
    "duration": ("s", "duration of the motion"),
    "attitude_difference": ("rad", "largest difference of the base attitude to the finer re-run"),
    "position_difference": ("m", "largest difference of the base position to the finer re-run"),
    "boundary_error": ("1", "largest miss of the joint motion asked for at both ends, rad or m and s"),
    "violation": (
        "1",
        "largest violation of a constraint in the finer re-run, as the search counts it; 0: all kept",
    ),
    "momentum_drift": ("1", "relative drift of the momentum in the finer re-run"),
}
# As the conventions for climate and forecast metadata (CF, 3.5) have flags.
_CODES = {
    "flag_values": np.array([MISSING, *map(int, ResultCode)]),
    "flag_meanings": " ".join(["not_computed", *(code.name.lower() for code in ResultCode)]),
}
_COUNTS = ("code", "evaluations", "gradient_evaluations")
_HISTORY = {
    "history_best_value": "best index so far",
    "history_evaluations": "objective evaluations until then",
    "history_gradient_evaluations": "gradient evaluations until then",
}
_KEY_UNITS = {
    "task.duration": "s",
    "task.linear_momentum": "N s",
    "task.angular_momentum": "N m s",
    "task.base_position": "m",
    "objective.tool_position.scale": "m",
    "constraints.clearance.margin": "m",
    "constraints.clearance.tolerance": "m",
    "constraints.final_attitude.tolerance": "rad",
}


def merged(
    points: Sequence[Point],
    parts: Sequence[Part],
    name: str,
    accuracy: float,
    failures: Mapping[int, str] | None = None,
):
    """An xarray Dataset over the points; what a point has not is NaN, its code -1 where it was not computed.

    failures: reasons of the points that could not be computed, by their numbers.
    """
    import xarray

    count = len(points)
    variables: dict[str, Any] = {}
    limits = dict.fromkeys(key for part in parts for key in part.results if key.startswith(OVERRUN))
    overruns = {
        key: ("1", f"largest relative overrun of a limit: {key.removeprefix(OVERRUN)}") for key in limits
    }
    for quantity, (unit, meaning) in {**_UNITS, **overruns}.items():
        blank = MISSING if quantity == "code" else 0 if quantity in _COUNTS else np.nan
        values = np.full(count, blank, dtype=np.int64 if quantity in _COUNTS else float)
        for part in parts:
            if quantity in part.results:
                values[list(part.numbers)] = part.results[quantity]
        attributes = {"units": unit, "long_name": meaning}
        variables[quantity] = ("point", values, attributes | (_CODES if quantity == "code" else {}))
    variables |= merged_misses(count, ((part.numbers, part.results) for part in parts))
    variables["free_numbers"] = (
        ("point", "free"),
        _padded(count, parts, "free_numbers"),
        {"units": "1", "long_name": "free numbers of the trajectory, NaN behind the last"},
    )
    names = sorted({str(name) for part in parts for name in part.results["terms"]})
    for quantity, meaning in (("value", "before weighting"), ("weighted", "after weighting")):
        values = np.full((count, len(names)), np.nan)
        for part in parts:
            columns = [names.index(str(name)) for name in part.results["terms"]]
            values[np.ix_(list(part.numbers), columns)] = part.results[f"term_{quantity}"]
        attributes = {"units": "1", "long_name": f"terms of the finer re-run {meaning}"}
        variables[f"term_{quantity}"] = (("point", "term"), values, attributes)
    for quantity, meaning in _HISTORY.items():
        attributes = {"units": "1", "long_name": f"{meaning}; steps spread evenly over the search"}
        variables[quantity] = (("point", "step"), _padded(count, parts, quantity), attributes)
    if failures:
        reasons = np.array([failures.get(number, "") for number in range(count)])
        variables[FAILURE] = ("point", reasons, {"long_name": "why the point could not be computed"})
    keys = swept_keys(points)
    for key in keys:
        unit = "deg" if key.endswith("_deg") else _KEY_UNITS.get(key, "1")
        variables[key] = ("point", _column(points, key), {"units": unit, "long_name": f"swept key {key}"})
    dataset = xarray.Dataset(
        variables,
        coords={
            "point": ("point", np.arange(count)),
            "term": ("term", np.array(names or [""])[: len(names)]),
        },
        attrs={"name": name, "kind": "sweep", "swept_keys": json.dumps(keys), "accuracy": accuracy},
    )
    return dataset.set_coords(keys)


def swept_keys(points: Sequence[Point]) -> list[str]:
    """The keys that any point sets, in the order of their first use."""
    return list(dict.fromkeys(key for point in points for key in point.values))


def _padded(count: int, parts: Sequence[Part], quantity: str) -> np.ndarray:
    width = max((part.results[quantity].shape[1] for part in parts), default=0)
    values = np.full((count, width), np.nan)
    for part in parts:
        found = part.results[quantity]
        values[list(part.numbers), : found.shape[1]] = found
    return values


def _column(points: Sequence[Point], key: str) -> np.ndarray:
    """A key's values as whole numbers, numbers, or text: what the sweep set, else what the point has from elsewhere."""
    values = [point.values[key] if key in point.values else _effective(point, key) for point in points]
    plain = [None if isinstance(value, bool) else value for value in values]
    if all(isinstance(value, int) and abs(value) < 2**63 for value in plain):
        return np.array(values, dtype=np.int64)
    if all(isinstance(value, int | float) for value in plain):
        return np.array(values, dtype=float)
    return np.array([value_text(value) for value in values])


def _effective(point: Point, key: str) -> Any:
    here: Any = point.config.model_dump()
    for part in key.split("."):
        if isinstance(here, list | tuple) and part.isdecimal() and int(part) < len(here):
            here = here[int(part)]
        else:
            here = here.get(part) if isinstance(here, dict) else None
    return here


def save_sweep(dataset: Any, path: Path) -> None:
    """Write a sweep as netCDF-4 atomically, its texts as fixed-width characters, which every reader knows."""
    texts = {name: {"dtype": "S1"} for name, values in dataset.variables.items() if values.dtype.kind == "U"}
    save_dataset(dataset, path, texts)
