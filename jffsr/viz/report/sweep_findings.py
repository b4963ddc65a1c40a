"""What a merged sweep says in words: its best setting, what binds in each, and the points that fell short."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from jffsr.planning.result import ResultCode
from jffsr.study.sweep.best import best_point, find_best, unit_of
from jffsr.study.sweep.compute import OVERRUN
from jffsr.study.sweep.ended import failures_of
from jffsr.study.sweep.merging import MISSING
from jffsr.study.sweep.misses import MISSED, missed_in_words
from jffsr.study.sweep.significance import ranked_cost
from jffsr.study.sweep.table import keys_of, rows_of
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
        rows.append((key, len(values), shown + more, unit_of(dataset, key)))
    return table(("key", "how many", "values", "unit"), rows)


def best_setting(dataset: Dataset) -> str:
    """The best setting in a sentence, and what makes it the best."""
    best = find_best(dataset)
    if best is None:
        constrained = any(str(name).startswith(MISSED) for name in dataset.data_vars)
        why = ": in none did the search find a motion that keeps every constraint" if constrained else ""
        return f"<p>No point of this sweep has a value of J{why}.</p>"
    return (
        f'<p class="verdict {"met" if best.met else "missed"}">Best setting: {escape(best.sentence)}.</p>'
        "<p>That is the setting most of whose runs met their accuracy, and among equals the one with the least "
        f"median J, or the least J where medians are equal. Of {best.settings} settings {best.whole} met it in every "
        "run.</p>"
    )


def binding_table(dataset: Dataset, kept_by_law: Collection[str] = ()) -> str:
    """For each setting what binds in its best run: the costliest term and the limit that has least left.

    kept_by_law names limits, such as position, that the joint law touches without ever going beyond: they say nothing.
    """
    keys, rows, limited = keys_of(dataset), [], False
    for row in rows_of(dataset)[:_MOST_SETTINGS]:
        values = list(row.values.values())
        if not np.any(np.isfinite(row.cost)):
            rows.append((*values, None, "no run has a value", "", ""))
            continue
        point = best_point(row)
        limit = _nearest_limit(dataset, point, kept_by_law)
        limited = limited or bool(limit)
        rows.append((*values, float(dataset["cost_finer"].values[point]), *_costliest(dataset, point), limit))
    heads = [*keys, "J of the best run", "term that costs most", "its share"]
    heads.append("limit with least left" if limited else "")
    words = (
        "<p>Of the best run of each setting, at the finer re-run. A setting whose accuracy is missed is held back by "
        "the term that costs most; a limit with nothing left is where its motion goes as far as it may.</p>"
    )
    if limited and kept_by_law:
        words += (
            f"<p>Limits of {', '.join(kept_by_law)} are left out: the joint law goes as far as they allow, and never "
            "beyond.</p>"
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
    missed = missed_in_words(dataset, point)
    if code == ResultCode.NOT_VERIFIED:
        words = (
            f"not verified: the finer re-run differs by {value('attitude_difference'):.2g} rad, the momentum drifts by "
            f"{value('momentum_drift'):.2g} relative; raise rollout.num_steps"
        )
        return "; ".join((words, *missed))
    if code == ResultCode.CONSTRAINTS_VIOLATED:
        # A sweep of an earlier version does not say which.
        return "; ".join(missed) or "a constraint is missed"
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


def _nearest_limit(dataset: Dataset, point: int, without: Collection[str] = ()) -> str:
    """The limit with the least left, or overrun the most; an empty text where there is none."""
    overruns: Mapping[str, float] = {
        name.removeprefix(OVERRUN): float(dataset[name].values[point])
        for name in map(str, dataset.data_vars)
        if name.startswith(OVERRUN)
    }
    finite = {name: value for name, value in overruns.items() if np.isfinite(value) and name not in without}
    if not finite:
        return ""
    name = max(finite, key=lambda kind: finite[kind])
    over = 100 * finite[name]
    kind = "base excursion" if name == "excursion" else f"joint {name}"
    if finite[name] > _KEPT:
        return f"{kind}, over by {over:.3g} %"
    return f"{kind}, less than 0.01 % left" if over > -0.01 else f"{kind}, {-over:.3g} % left"
