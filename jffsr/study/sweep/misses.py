"""By how much each point of a sweep misses each of its constraints, in the constraint's own unit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.objectives.constraints import in_units, tolerance_of
from jffsr.planning.problem import Problem

if TYPE_CHECKING:
    from xarray import Dataset

MISSED, ALLOWED = "missed_", "allowed_"
"""What the names of the merged file's variables begin with."""


def misses_of(problems: Sequence[Problem], violations: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Arrays (points, constraints) of a task's problems, whose constraints have the same names, and those names."""
    constraints = problems[0].constraints
    rows = [problem.constraints for problem in problems]
    found = [np.asarray(violations[constraint.name], float) for constraint in constraints]
    missed = [[in_units(c, found[k][p])[0] for k, c in enumerate(row)] for p, row in enumerate(rows)]
    allowed = [[in_units(c, np.max(tolerance_of(c)))[0] for c in row] for row in rows]
    shape = (len(rows), len(constraints))
    return {
        "constraints": np.array([c.name for c in constraints], dtype=np.str_),
        "constraint_units": np.array([in_units(c, 0.0)[1] for c in constraints], dtype=np.str_),
        "constraint_missed": np.reshape(np.array(missed, float), shape),
        "constraint_allowed": np.reshape(np.array(allowed, float), shape),
    }


def merged_misses(
    count: int, found: Iterable[tuple[Sequence[int], Mapping[str, np.ndarray]]]
) -> dict[str, Any]:
    """Two variables over the points for each constraint that any of them has; NaN where a point does not have it.

    found: the numbers of points, and what `misses_of` gave for them, among other results.
    """
    variables: dict[str, Any] = {}
    for numbers, results in found:
        # Parts that an earlier version wrote do not tell.
        for column, name in enumerate(results.get("constraints", ())):
            unit = str(results["constraint_units"][column]) or "1"
            for prefix, key, meaning in (
                (MISSED, "constraint_missed", "misses in the finer re-run"),
                (ALLOWED, "constraint_allowed", "may miss"),
            ):
                attributes = {
                    "units": unit,
                    "long_name": f"by how much a point {meaning} the constraint {name}",
                }
                kept = variables.setdefault(f"{prefix}{name}", ("point", np.full(count, np.nan), attributes))
                kept[1][list(numbers)] = results[key][:, column]
    return variables


def missed_in_words(dataset: Dataset, point: int) -> list[str]:
    """Each constraint that a point misses by more than it may, and by how much, the worst first."""
    found = []
    for name in (
        str(name).removeprefix(MISSED) for name in dataset.data_vars if str(name).startswith(MISSED)
    ):
        missed, allowed = (float(dataset[f"{prefix}{name}"].values[point]) for prefix in (MISSED, ALLOWED))
        if missed > allowed:
            unit = dataset[f"{MISSED}{name}"].attrs.get("units", "1")
            words = "" if unit == "1" else f" {unit}"
            text = f"{name.replace('_', ' ')} missed by {missed:.3g}{words} (allowed {allowed:.3g}{words})"
            found.append((missed / max(allowed, np.finfo(float).tiny), text))
    return [text for _, text in sorted(found, key=lambda one: -one[0])]
