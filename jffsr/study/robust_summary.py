"""How a plan made for uncertain robots fares on robots that it was not made with, for its summary."""

from __future__ import annotations

from typing import Any

import numpy as np

from jffsr.planning.plan import Plan
from jffsr.planning.spread import index_over
from jffsr.robots.perturbation import perturbed
from jffsr.study.schema_solver import Robust

_FRESH = 256
_QUANTILES = (0.05, 0.5, 0.95)


def robust_summary(plan: Plan, wanted: Robust) -> dict[str, Any]:
    """Plain data under `robust`: the measure, and the spread of the index over fresh robots; nothing if not wanted."""
    if wanted.samples == 0:
        return {}
    # The seed after the planning's own draws other robots.
    robots = perturbed(plan.problem.robot, wanted.seed + 1, _FRESH, **wanted.deviations)
    index = index_over(plan.problem, plan.free, robots)
    accuracy = float(plan.problem.objective.accuracy)
    return {
        "robust": {
            "measure": wanted.measure,
            "level": wanted.level,
            "samples": wanted.samples,
            "value": float(plan.verification.measure),
            "nominal": float(plan.verification.cost),
            "fresh_robots": _FRESH,
            "mean": float(np.mean(index)),
            "worst": float(np.max(index)),
            "quantiles": {f"{q:g}": float(np.quantile(index, q)) for q in _QUANTILES},
            "share_met": float(np.mean(index <= accuracy)),
        }
    }


def robust_lines(summary: dict[str, Any] | None) -> list[str]:
    """The same in a line for the terminal; none where it was not asked for."""
    if not summary:
        return []
    values = (summary["value"], *(summary["quantiles"][f"{q:g}"] for q in _QUANTILES))
    # What is not finite is written as null.
    value, low, middle, high = ("not finite" if x is None else f"{x:.4g}" for x in values)
    return [
        f"  robust        {summary['measure']} of J {value}; over {summary['fresh_robots']} other robots J is {middle} "
        f"({low} to {high} for nine in ten), met by {100 * summary['share_met']:.0f} %"
    ]
