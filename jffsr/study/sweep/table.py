"""What a sweep found, in numbers: a row for each setting, over its seeds."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.merging import MISSING
from jffsr.study.sweep.significance import Comparison, ranked_cost

MOST_PRINTED = 40


@dataclass(frozen=True)
class Row:
    """A setting: its values, its points, and their codes, ranked costs and evaluations (computed points alone)."""

    values: dict[str, Any]
    points: np.ndarray
    code: np.ndarray
    cost: np.ndarray
    evaluations: np.ndarray
    gradient_evaluations: np.ndarray


def keys_of(dataset: Any, seeds: bool = False) -> list[str]:
    """The swept keys of a merged sweep, the seed left out unless asked for."""
    return [key for key in json.loads(dataset.attrs["swept_keys"]) if seeds or key != "seed"]


def rows_of(dataset: Any, keys: Sequence[str] | None = None) -> list[Row]:
    """A row for each combination of the keys' values (all but the seed), in the order of the points."""
    keys = keys_of(dataset) if keys is None else list(keys)
    columns = [dataset[key].values.tolist() for key in keys]
    cost = ranked_cost(dataset)
    groups: dict[tuple, list[int]] = {}
    for point in range(dataset.sizes["point"]):
        groups.setdefault(tuple(column[point] for column in columns), []).append(point)
    rows = []
    for values, members in groups.items():
        points = np.array(members)
        points = points[dataset["code"].values[points] != MISSING]
        code, evaluations, gradients = (
            dataset[name].values[points] for name in ("code", "evaluations", "gradient_evaluations")
        )
        named = dict(zip(keys, values, strict=True))
        rows.append(Row(named, points, code, cost[points], evaluations, gradients))
    return rows


def markdown(dataset: Any, comparisons: Sequence[Comparison], most: int | None = None) -> str:
    """The table of a merged sweep and what its rank tests say, as Markdown; at most `most` rows."""
    rows = rows_of(dataset)
    head = [
        *keys_of(dataset), "runs", "met", "J best", "J lower quartile", "J median", "J upper quartile",
        "J worst", "evaluations", "gradients",
    ]  # fmt: skip
    lines = [_line(head), _line(["---"] * len(head))]
    shown = rows if most is None else rows[:most]
    for row in shown:
        cells = [_cell(value) for value in row.values.values()]
        met = np.count_nonzero(row.code == ResultCode.ACCURACY_MET)
        quartiles = np.full(5, np.nan) if not row.cost.size else [quantile(row.cost, k / 4) for k in range(5)]
        counts = [_median(row.evaluations), _median(row.gradient_evaluations)]
        lines.append(_line([*cells, str(row.points.size), str(met), *map(_number, quartiles), *counts]))
    if len(shown) < len(rows):
        lines += ["", f"{len(rows) - len(shown)} more settings are in table.md."]
    lost = any(np.any(np.isinf(row.cost)) for row in rows)
    lines += [
        "",
        "Evaluations and gradients are medians. J is the published index at the planner's own step"
        + (
            ", infinite where the search found no motion, or none that keeps every constraint."
            if lost
            else "."
        ),
    ]
    for comparison in comparisons:
        lines += ["", comparison.to_markdown()]
    return "\n".join(lines) + "\n"


def quantile(values: np.ndarray, share: float) -> float:
    """The quantile of values (k,), k >= 1, interpolated linearly; infinite beside a value that is."""
    ordered = np.sort(values)
    place = share * (len(ordered) - 1)
    below, part = int(place), place - int(place)
    return float(ordered[below] + (part * (ordered[below + 1] - ordered[below]) if part else 0.0))


def _median(counts: np.ndarray) -> str:
    return f"{np.median(counts):g}" if counts.size else "-"


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4g}"


def _cell(value: Any) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text.replace("|", "\\|")


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
