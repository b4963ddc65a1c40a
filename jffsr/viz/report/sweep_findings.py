"""What a merged sweep says in words: its best setting, what binds in each, and the points that fell short."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.compute import OVERRUN
from jffsr.study.sweep.ended import failures_of
from jffsr.study.sweep.merging import MISSING
from jffsr.study.sweep.points import value_text
from jffsr.study.sweep.significance import ranked_cost
from jffsr.study.sweep.table import Row, keys_of, rows_of
from jffsr.viz.report.tables import number, table

if TYPE_CHECKING:
    from xarray import Dataset

_MOST_VALUES, _MOST_SETTINGS, _MOST_POINTS = 12, 60, 40
_KEPT = 1e-3
"""Relative overrun of a limit that counts as none, as in the verification's default."""


def varied_table(dataset: Dataset) -> str:
    """The swept keys with their values and units."""
    rows = []
    for key in keys_of(dataset, seeds=True):
        values = list(dict.fromkeys(dataset[key].values.tolist()))
        shown = ", ".join(number(value) for value in values[:_MOST_VALUES])
        more = f" and {len(values) - _MOST_VALUES} more" if len(values) > _MOST_VALUES else ""
        rows.append((key, len(values), shown + more, _unit(dataset, key)))
    return table(("key", "how many", "values", "unit"), rows)


def best_setting(dataset: Dataset) -> str:
    """The setting most of whose runs met their accuracy, among equals that with the least median J, in a sentence."""
    rows = [row for row in rows_of(dataset) if np.any(np.isfinite(row.cost))]
    if not rows:
        return "<p>No point of this sweep has a value of J.</p>"
    best = min(rows, key=lambda row: (-np.mean(row.code == ResultCode.ACCURACY_MET), _median(row.cost)))
    met, count = int(np.count_nonzero(best.code == ResultCode.ACCURACY_MET)), best.points.size
    point = _best_point(best)
    cost = float(dataset["cost"].values[point])
    accuracy = float(dataset.attrs.get("accuracy", np.nan))
    asked = f" (J at most {accuracy:.4g})" if np.isfinite(accuracy) else ""
    if count == 1:
        found = f"J {cost:.4g}, accuracy{asked} {'met' if met else 'not met'}"
    else:
        values = f"J at best {cost:.4g}, median {_median(best.cost):.4g}"
        found = f"accuracy{asked} met by {met} of its {count} runs, {values}"
    whole = sum(bool(np.all(row.code == ResultCode.ACCURACY_MET)) for row in rows)
    return (
        f'<p class="verdict {"met" if met else "missed"}">Best setting: {escape(_values(best, dataset))}: {found}.</p>'
        "<p>That is the setting most of whose runs met their accuracy, and among equals the one with the least "
        f"median J. Of {len(rows)} settings {whole} met it in every run.</p>"
    )


def binding_table(dataset: Dataset) -> str:
    """For each setting what binds in its best run: the costliest term and the limit that has least left."""
    keys, rows, limited = keys_of(dataset), [], False
    for row in rows_of(dataset)[:_MOST_SETTINGS]:
        values = list(row.values.values())
        if not np.any(np.isfinite(row.cost)):
            rows.append((*values, None, "no run has a value", "", ""))
            continue
        point = _best_point(row)
        limit = _nearest_limit(dataset, point)
        limited = limited or bool(limit)
        rows.append((*values, float(dataset["cost_finer"].values[point]), *_costliest(dataset, point), limit))
    heads = [*keys, "J of the best run", "term that costs most", "its share"]
    heads.append("limit with least left" if limited else "")
    words = (
        "<p>Of the best run of each setting, at the finer re-run. A setting whose accuracy is missed is held back by "
        "the term that costs most; a limit with nothing left is where its motion goes as far as it may.</p>"
    )
    if not limited:
        heads, rows = heads[:-1], [row[:-1] for row in rows]
    left = len(rows_of(dataset)) - len(rows)
    return words + table(heads, rows) + (f"<p>{left} more settings are in sweep.nc.</p>" if left else "")


def short_points(dataset: Dataset) -> str:
    """The points that missed their accuracy or could not be computed, each with the reason; nothing where none did."""
    code, failed = dataset["code"].values, failures_of(dataset)
    missed = np.flatnonzero(code != ResultCode.ACCURACY_MET)
    if not len(missed):
        return ""
    keys = keys_of(dataset, seeds=True)
    columns = [dataset[key].values.tolist() for key in keys]
    # Those that could not be computed first: something is wrong with them.
    ordered = sorted(missed.tolist(), key=lambda point: (code[point] != MISSING, point))
    cost = ranked_cost(dataset)
    rows = [
        (
            point,
            *(column[point] for column in columns),
            float(cost[point]) if np.isfinite(cost[point]) else None,
            failed[point] if point in failed else _why(dataset, point),
        )
        for point in ordered[:_MOST_POINTS]
    ]
    counts = f"{len(missed) - len(failed)} points missed their accuracy"
    counts += f", {len(failed)} could not be computed (the same command tries them again)" if failed else ""
    more = len(ordered) - len(rows)
    rest = f"<p>{more} more such points are in sweep.nc.</p>" if more else ""
    return f"<p>{counts}.</p>" + table(("point", *keys, "J", "why"), rows) + rest


def _why(dataset: Dataset, point: int) -> str:
    """Why a computed point fell short, by its code and the numbers behind it."""

    def value(name: str) -> float:
        return float(dataset[name].values[point])

    code = int(dataset["code"].values[point])
    if code == ResultCode.NOT_FINITE:
        return "the motion is not finite"
    if code == ResultCode.NOT_VERIFIED:
        return (
            f"not verified: the finer re-run differs by {value('attitude_difference'):.2g} rad, the momentum drifts by "
            f"{value('momentum_drift'):.2g} relative; raise rollout.num_steps"
        )
    if code == ResultCode.CONSTRAINTS_VIOLATED:
        return f"a constraint is missed by {value('violation'):.3g}"
    limit = _nearest_limit(dataset, point)
    if code == ResultCode.LIMITS_VIOLATED:
        return f"a limit is not kept: {limit}"
    name, share = _costliest(dataset, point)
    most = f"{name} costs most ({share} of J)" if name else "J is too large"
    over = f"; {limit}" if "over by" in limit else ""
    if code == ResultCode.NOT_CONVERGED:
        return f"the search was still getting better when its budget ended; {most}{over}"
    return f"the search settled above the accuracy; {most}{over}"


def _costliest(dataset: Dataset, point: int) -> tuple[str, str]:
    """The term that costs most at the finer re-run, and its share of all terms."""
    weighted = dataset["term_weighted"].values[point]
    total = np.nansum(weighted)
    if not weighted.size or not np.isfinite(total) or total <= 0:
        return "", ""
    most = int(np.nanargmax(weighted))
    return str(dataset["term"].values[most]).replace("_", " "), f"{100 * weighted[most] / total:.0f} %"


def _nearest_limit(dataset: Dataset, point: int) -> str:
    """The limit with the least left, or overrun the most; an empty text where there is none."""
    overruns: Mapping[str, float] = {
        name.removeprefix(OVERRUN): float(dataset[name].values[point])
        for name in map(str, dataset.data_vars)
        if name.startswith(OVERRUN)
    }
    finite = {name: value for name, value in overruns.items() if np.isfinite(value)}
    if not finite:
        return ""
    name = max(finite, key=lambda kind: finite[kind])
    over = 100 * finite[name]
    kind = "base excursion" if name == "excursion" else f"joint {name}"
    if finite[name] > _KEPT:
        return f"{kind}, over by {over:.3g} %"
    return f"{kind}, {max(-over, 0.0):.3g} % left"


def _best_point(row: Row) -> int:
    """The number of a setting's point with the least J among those that met their accuracy, else among all."""
    met = row.code == ResultCode.ACCURACY_MET
    cost = np.where(met, row.cost, np.inf) if met.any() else row.cost
    return int(row.points[np.argmin(np.where(np.isnan(cost), np.inf, cost))])


def _median(cost: np.ndarray) -> float:
    return float(np.quantile(cost, 0.5, method="linear" if np.all(np.isfinite(cost)) else "nearest"))


def _values(row: Row, dataset: Dataset) -> str:
    """A setting as a person writes it, with units."""
    parts = [f"{key} = {_value(value)} {_unit(dataset, key)}".strip() for key, value in row.values.items()]
    return ", ".join(parts) or "the only one"


def _value(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else value_text(value)


def _unit(dataset: Dataset, key: str) -> str:
    unit = str(dataset[key].attrs.get("units", "1"))
    return "" if unit == "1" else unit
