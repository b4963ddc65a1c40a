"""The best setting of a merged sweep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.points import value_text
from jffsr.study.sweep.table import Row, quantile, rows_of

if TYPE_CHECKING:
    from xarray import Dataset


@dataclass(frozen=True)
class Best:
    """The best setting in words, whether a run of it met its accuracy, and how many of all did in every run."""

    sentence: str
    met: bool
    settings: int
    whole: int


def find_best(dataset: Dataset) -> Best | None:
    """The setting most of whose runs met their accuracy; None without J.

    Among equals it is the one with the least median J, then with the least J; a run that broke a constraint has an
    infinite one.
    """
    rows = [row for row in rows_of(dataset) if np.any(np.isfinite(row.cost))]
    if not rows:
        return None
    best = min(rows, key=lambda row: _merit(row))
    met, count = int(np.count_nonzero(best.code == ResultCode.ACCURACY_MET)), best.points.size
    cost = float(dataset["cost"].values[best_point(best)])
    accuracy = float(dataset.attrs.get("accuracy", np.nan))
    asked = f" (J at most {accuracy:.4g})" if np.isfinite(accuracy) else ""
    if count == 1:
        found = f"J {cost:.4g}, accuracy{asked} {'met' if met else 'not met'}"
    else:
        values = f"J at best {cost:.4g}, median {quantile(best.cost, 0.5):.4g}"
        found = f"accuracy{asked} met by {met} of its {count} runs, {values}"
    whole = sum(bool(np.all(row.code == ResultCode.ACCURACY_MET)) for row in rows)
    return Best(f"{_values(best, dataset)}: {found}", met > 0, len(rows), whole)


def _merit(row: Row) -> tuple[float, float, float]:
    """What is smaller for the better setting."""
    met = float(np.mean(row.code == ResultCode.ACCURACY_MET))
    return -met, quantile(row.cost, 0.5), float(np.min(row.cost))


def best_point(row: Row) -> int:
    """The number of a setting's point with the least J among those that met their accuracy, else among all."""
    met = row.code == ResultCode.ACCURACY_MET
    cost = np.where(met, row.cost, np.inf) if met.any() else row.cost
    return int(row.points[np.argmin(np.where(np.isnan(cost), np.inf, cost))])


def _values(row: Row, dataset: Dataset) -> str:
    """A setting as a person writes it, with units."""
    parts = [f"{key} = {_value(value)} {unit_of(dataset, key)}".strip() for key, value in row.values.items()]
    return ", ".join(parts) or "the only one"


def _value(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else value_text(value)


def unit_of(dataset: Dataset, key: str) -> str:
    """The unit of a swept key; empty for a ratio or a name."""
    unit = str(dataset[key].attrs.get("units", "1"))
    return "" if unit == "1" else unit
