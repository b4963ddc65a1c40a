"""The summary of a run: what summary.json holds and what the command line prints."""

from __future__ import annotations

import platform
from collections.abc import Iterable, Mapping
from importlib import metadata
from typing import Any

import numpy as np

from jffsr.objectives.clearance import Clearance
from jffsr.objectives.constraints import Constraint, in_units, tolerance_of
from jffsr.objectives.terms import attitude_angles
from jffsr.planning.plan import Plan
from jffsr.planning.result import LIMIT_KINDS, torque_unseen, violations
from jffsr.rollouts.motion import Motion
from jffsr.study.dataset import excursion_limit
from jffsr.study.robust_summary import robust_lines
from jffsr.study.sensitivity_summary import sensitivity_lines, sensitivity_summary

NOT_LOOKED_AT = "whether bodies touch was not looked at; the key constraints.clearance asks for it"
TORQUE_UNSEEN = "the limits of torque were not looked at; objective.joint_torque.enabled: true asks for it"
_PACKAGES = ("jffsr", "jax", "jaxlib", "numpy", "optax", "mujoco", "mujoco-mjx")


def plan_summary(plan: Plan, name: str, seed: int, tolerances) -> dict[str, Any]:
    """The summary of a plan, plain data; arrays and numbers that are not finite are left to the writer."""
    verification, problem = plan.verification, plan.problem
    units = problem.objective.units
    clearance = [
        one.nearest(problem.robot, plan.motion) for one in problem.constraints if isinstance(one, Clearance)
    ]
    _, measure = excursion_limit(problem)
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
            key: {"value": float(term.value), "unit": units[key], "weighted": float(term.weighted)}
            for key, term in plan.terms.items()
        },
        "base": _base(plan.motion, measure),
        "nearest_approach": [
            {"bodies": found.pair, "distance_m": found.distance, "time_s": found.time, "sentence": str(found)}
            for found in clearance
        ],
        "torque_limits_looked_at": not torque_unseen(problem),
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
            "constraints": constraints_summary(problem.constraints, verification.violations),
            "limits_violated": list(violations(plan.problem, verification.overruns, tolerances)),
            "largest_overrun_relative": {
                kind: float(np.max(getattr(verification.overruns, kind))) for kind in LIMIT_KINDS
            },
        },
        "sensitivity": None if plan.sensitivity is None else sensitivity_summary(plan.sensitivity),
    }


def _base(motion: Motion, measure: str) -> dict[str, float]:
    """How far the base is turned from its start, in all and about an axis, and how far its centre of mass has moved."""
    start, q = np.asarray(motion.base_quaternion)[0], np.asarray(motion.base_quaternion)
    # Of two unit quaternions: their difference and sum are twice the sine and cosine of a quarter of the turn.
    apart, along = (np.linalg.norm(part, axis=-1) for part in (q - start, q + start))
    turn = 4 * np.arctan2(np.minimum(apart, along), np.maximum(apart, along))
    moved = np.linalg.norm(np.asarray(motion.base_position) - np.asarray(motion.base_position)[0], axis=-1)
    return {
        "final_turn_rad": float(turn[-1]),
        "largest_turn_rad": float(np.max(turn)),
        "largest_turn_about_an_axis_rad": float(np.max(np.abs(attitude_angles(motion, measure)))),
        "largest_displacement_m": float(np.max(moved)),
    }


def constraints_summary(constraints: Iterable[Constraint], violations: Mapping[str, Any]) -> dict[str, Any]:
    """How far each constraint is missed and may be, in its unit; without one it is a ratio."""
    found = {}
    for constraint in constraints:
        missed, unit = in_units(constraint, violations[constraint.name])
        allowed, _ = in_units(constraint, tolerance_of(constraint))
        found[constraint.name] = {"violation": missed, "tolerance": allowed, "unit": unit}
    return found


def constraint_lines(verification: Mapping[str, Any]) -> list[str]:
    """A line for each constraint of a verification."""
    lines = []
    for name, constraint in verification.get("constraints", {}).items():
        missed, allowed = _number(constraint["violation"]), _number(constraint["tolerance"])
        unit = f" {constraint['unit']}" if constraint.get("unit") else ""
        lines.append(f"  constraint    {name} missed by {missed}{unit} (allowed {allowed}{unit})")
    return lines


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
    check = summary["verification"]
    finer = {key: term["weighted"] for key, term in check["terms_finer"].items()}
    lines.append(f"  {'term':<22}{'value':>12} {'':<10}{'weighted':>12}{'finer re-run':>14}")
    for key, term in summary["terms"].items():
        value, weighted = _number(term["value"]), _number(term["weighted"])
        again = _number(finer[key]) if key in finer else ""
        lines.append(f"  {key:<22}{value:>12} {term.get('unit', ''):<10}{weighted:>12}{again:>14}")
    found = _number(check["cost_finer"])
    lines.append(f"  {'index J':<22}{'':>12} {'':<10}{_number(summary['cost']):>12}{found:>14}")
    lines += ["", *_motion_lines(summary)]
    counts, reached = summary["evaluations"], summary["evaluations_to_accuracy"]
    lines += [f"  evaluations   {counts['objective']} of the objective, {counts['gradient']} gradients"]
    if reached is not None:
        lines.append(
            f"                J was small enough after {reached['objective']} of the objective and "
            f"{reached['gradient']} gradients"
        )
    lines.append(
        f"  finer re-run  attitude {_number(check['attitude_difference_rad'])} rad, "
        f"position {_number(check['position_difference_m'])} m, "
        f"momentum drift {_number(check['momentum_drift_relative'])}"
    )
    lines += constraint_lines(check)
    lines += sensitivity_lines(summary.get("sensitivity"))
    lines += robust_lines(summary.get("robust"))
    return "\n".join(lines + last_lines(summary))


def _motion_lines(summary: dict[str, Any]) -> list[str]:
    """What the base does, and how near bodies come."""
    base, lines = summary.get("base"), []
    if base is not None:
        final, most = (_degrees(base[key]) for key in ("final_turn_rad", "largest_turn_rad"))
        moved = _number(base["largest_displacement_m"])
        axis = base.get("largest_turn_about_an_axis_rad")
        about = "" if axis is None else f" ({_degrees(axis)} about one axis, which limits count)"
        lines.append(
            f"  base          turned by {final} at the end, {most} at most{about}; moved by {moved} m at most"
        )
    near = summary.get("nearest_approach")
    if near is not None:
        told = [f"{found['sentence']}, at the planner's steps" for found in near] or [NOT_LOOKED_AT]
        lines += [f"  clearance     {sentence}" for sentence in told]
    if summary.get("torque_limits_looked_at") is False:
        lines.append(f"  torque        {TORQUE_UNSEEN}")
    return lines


def last_lines(summary: dict[str, Any]) -> list[str]:
    """What the simulators said, where they were asked, and how long it took: of studies of any kind."""
    crosscheck, seconds = summary["verification"].get("mujoco"), summary["seconds"]
    lines = [f"  simulators    {crosscheck['sentence']}"] if crosscheck else []
    return [
        *lines,
        f"  seconds       {seconds['total']:.1f} in all, {seconds['compile']:.1f} of them compiling",
    ]


def _degrees(value: float | None) -> str:
    return "not finite" if value is None else f"{np.rad2deg(value):.4g} deg"


def _number(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.4g}"
