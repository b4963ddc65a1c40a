"""The summary of a run: what summary.json holds and what the command line prints."""

from __future__ import annotations

import platform
from importlib import metadata
from typing import Any

import numpy as np

from jffsr.objectives.constraints import tolerance_of
from jffsr.planning.plan import Plan
from jffsr.planning.result import LIMIT_KINDS, violations
from jffsr.study.robust_summary import robust_lines
from jffsr.study.sensitivity_summary import sensitivity_lines, sensitivity_summary

_PACKAGES = ("jffsr", "jax", "jaxlib", "numpy", "optax", "mujoco", "mujoco-mjx")


def plan_summary(plan: Plan, name: str, seed: int, tolerances) -> dict[str, Any]:
    """The summary of a plan, plain data; arrays and numbers that are not finite are left to the writer."""
    verification = plan.verification
    first = plan.first_at(float(plan.problem.objective.accuracy))
    return {
        "kind": "planning",
        "name": name,
        "robot": plan.problem.robot.name,
        "result": {
            "code": int(plan.result.code),
            "name": plan.result.code.name.lower(),
            "sentence": plan.result.sentence,
        },
        "cost": plan.cost,
        "terms": {
            key: {"value": float(term.value), "weighted": float(term.weighted)}
            for key, term in plan.terms.items()
        },
        "duration": float(np.asarray(plan.trajectory.duration)),
        "evaluations": {"objective": plan.evaluations, "gradient": plan.gradient_evaluations},
        "evaluations_to_accuracy": None
        if first is None
        else {"objective": first.evaluations, "gradient": first.gradient_evaluations},
        "search_ended": plan.reason,
        "seconds": plan.seconds,
        "seed": seed,
        "versions": versions(),
        "verification": {
            "attitude_difference_rad": float(verification.attitude_difference),
            "position_difference_m": float(verification.position_difference),
            "boundary_error": float(verification.boundary_error),
            "momentum_drift_relative": float(verification.momentum_drift),
            "cost_finer": float(verification.cost),
            "terms_finer": {
                key: {"value": float(term.value), "weighted": float(term.weighted)}
                for key, term in verification.terms.items()
            },
            "constraints": {
                constraint.name: {
                    "violation": float(verification.violations[constraint.name]),
                    "tolerance": float(tolerance_of(constraint)),
                }
                for constraint in plan.problem.constraints
            },
            "limits_violated": list(violations(plan.problem, verification.overruns, tolerances)),
            "largest_overrun_relative": {
                kind: float(np.max(getattr(verification.overruns, kind))) for kind in LIMIT_KINDS
            },
        },
        "sensitivity": None if plan.sensitivity is None else sensitivity_summary(plan.sensitivity),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a result depends on."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return found


def summary_text(summary: dict[str, Any]) -> str:
    """A summary for the terminal."""
    lines = [f"{summary['name']}: {summary['result']['sentence']}", ""]
    lines.append(f"  {'term':<22}{'value':>14}{'weighted':>12}")
    for key, term in summary["terms"].items():
        lines.append(f"  {key:<22}{_number(term['value']):>14}{_number(term['weighted']):>12}")
    lines.append(f"  {'index J':<22}{'':>14}{_number(summary['cost']):>12}")
    counts, reached = summary["evaluations"], summary["evaluations_to_accuracy"]
    lines += ["", f"  evaluations   {counts['objective']} of the objective, {counts['gradient']} gradients"]
    if reached is not None:
        lines.append(f"  J reached 'met' after {reached['objective']} and {reached['gradient']}")
    check = summary["verification"]
    lines.append(
        f"  finer re-run  attitude {_number(check['attitude_difference_rad'])} rad, "
        f"position {_number(check['position_difference_m'])} m, "
        f"momentum drift {_number(check['momentum_drift_relative'])}"
    )
    for name, constraint in check.get("constraints", {}).items():
        missed, allowed = _number(constraint["violation"]), _number(constraint["tolerance"])
        lines.append(f"  constraint    {name} missed by {missed} (allowed {allowed})")
    lines += sensitivity_lines(summary.get("sensitivity"))
    lines += robust_lines(summary.get("robust"))
    return "\n".join(lines + last_lines(summary))


def last_lines(summary: dict[str, Any]) -> list[str]:
    """What the simulators said, where they were asked, and how long it took: of studies of any kind."""
    crosscheck, seconds = summary["verification"].get("mujoco"), summary["seconds"]
    lines = [f"  simulators    {crosscheck['sentence']}"] if crosscheck else []
    return [
        *lines,
        f"  seconds       {seconds['total']:.1f} in all, {seconds['compile']:.1f} of them compiling",
    ]


def _number(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.4g}"
