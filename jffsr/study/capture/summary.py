"""The summary of a capture study: what summary.json holds and what the command line prints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from jffsr.capture.front import CaptureFront
from jffsr.capture.grasp_time import GraspTime
from jffsr.capture.plan import CapturePlan
from jffsr.planning.result import LIMIT_KINDS
from jffsr.study.capture.building import CaptureStudy
from jffsr.study.capture.planned import PlannedCapture
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.summary import constraint_lines, constraints_summary, last_lines, versions
from jffsr.types import Array

_PARTS = {"position_m": 0, "attitude_rad": 3, "linear_velocity_m_s": 6, "angular_velocity_rad_s": 9}


def capture_summary(
    config: CaptureConfig, study: CaptureStudy, found: PlannedCapture, seconds: Mapping[str, float]
) -> dict[str, Any]:
    """The summary, plain data."""
    plan = found.plan if found.plan is not None and found.plan.motion is not None else None
    return {
        "kind": "capture",
        "name": config.name,
        "robot": study.robot.name,
        "result": {
            "code": int(found.result.code),
            "name": found.result.code.name.lower(),
            "sentence": found.result.sentence,
        },
        "notes": list(study.notes),
        "cost": None if plan is None else plan.cost,
        "cost_before": None if plan is None else plan.before,
        "terms": {} if plan is None else _terms(plan),
        "grasp": found.grasp,
        "grasp_time": _grasp_time(found.chosen, found.age),
        "duration": None if plan is None else plan.duration,
        "grasp_error": None if plan is None else sizes(plan.error),
        "attempts": 0 if found.plan is None else found.plan.attempts,
        # Values come along with derivatives.
        "evaluations": {"objective": 0, "gradient": 0 if found.plan is None else found.plan.jacobians},
        "seconds": dict(seconds),
        "seed": config.seed,
        "versions": versions(),
        "verification": {} if plan is None else _verification(plan),
        "observation": None if found.observed is None else _observation(found),
        "front": None if found.front is None else front_summary(found.front),
    }


def sizes(error: Array) -> dict[str, float]:
    """Lengths of the four parts of an error (12,): position, attitude, linear and angular velocity."""
    error = np.asarray(error)
    return {name: float(np.linalg.norm(error[k : k + 3])) for name, k in _PARTS.items()}


def _terms(plan: CapturePlan) -> dict[str, dict[str, Any]]:
    units = plan.problem.objective.units
    return {
        name: {"value": float(term.value), "unit": units[name], "weighted": float(term.weighted)}
        for name, term in plan.terms.items()
    }


def _grasp_time(chosen: GraspTime, age: float) -> dict[str, Any]:
    return {
        "code": int(chosen.code),
        "name": chosen.code.name.lower(),
        "sentence": chosen.sentence,
        "time": None if chosen.candidate is None else chosen.candidate.time - age,
        "criterion": None if chosen.candidate is None else chosen.candidate.value,
        "candidates": len(chosen.candidates),
    }


def _verification(plan: CapturePlan) -> dict[str, Any]:
    found = plan.verification
    return {
        "attitude_difference_rad": float(found.attitude_difference),
        "position_difference_m": float(found.position_difference),
        "boundary_error": float(found.boundary_error),
        "momentum_drift_relative": float(found.momentum_drift),
        "constraints": constraints_summary(plan.problem.constraints, found.violations),
        "largest_overrun_relative": {
            kind: float(np.max(getattr(found.overruns, kind))) for kind in LIMIT_KINDS
        },
    }


def _observation(found: PlannedCapture) -> dict[str, Any]:
    observed, prediction = found.observed, found.prediction
    told: dict[str, Any] = {
        "exposures": observed.exposures,
        "seen": observed.seen,
        "filtered": observed.filtered,
        "used": observed.used,
        "lost": observed.lost,
    }
    if prediction is None:
        return told
    # The root of the trace: the expected size of an error of that covariance.
    deviations = np.sqrt(np.diag(prediction.covariance))
    return {
        **told,
        "predicted_to": float(prediction.time),
        "converged": observed.converged(prediction),
        "predicted_deviation": sizes(deviations),
        "prediction_error": sizes(found.prediction_error),
        "error_to_true_target": None if found.true_error is None else sizes(found.true_error),
    }


def front_summary(front: CaptureFront) -> dict[str, Any]:
    """How many solutions, their values, and those chosen by name."""
    return {
        "names": list(front.names),
        "solutions": len(front.plans),
        "values": np.asarray(front.values).tolist(),
        "chosen": {
            name: {
                "number": int(number),
                "values": dict(zip(front.names, map(float, front.values[number]), strict=True)),
                "duration": front.plans[number].duration,
            }
            for name, number in front.chosen.items()
        },
    }


def summary_text(summary: dict[str, Any]) -> str:
    """A summary for the terminal."""
    lines = [f"{summary['name']}: {summary['result']['sentence']}", ""]
    lines += [f"  note          {note}" for note in summary["notes"]]
    lines.append(f"  grasp time    {summary['grasp_time']['sentence']}")
    if summary["duration"] is not None:
        lines.append(f"  grasp         '{summary['grasp']}' after {summary['duration']:.4g} s")
        spent = f"{summary['attempts']} starts, {summary['evaluations']['gradient']} derivatives"
        lines.append(f"  missed by     {_sizes(summary['grasp_error'])}; {spent}")
        for name, term in summary["terms"].items():
            lines.append(f"  {name:<22}{_number(term['value']):>12}")
        if summary["cost_before"] is not None:
            lines.append(
                f"  objective     {_number(summary['cost'])}, before {_number(summary['cost_before'])}"
            )
    lines += _observation_lines(summary["observation"])
    lines += _front_lines(summary["front"])
    check = summary["verification"]
    if check.get("constraints"):
        lines.append(
            f"  finer re-run  attitude {_number(check['attitude_difference_rad'])} rad, "
            f"position {_number(check['position_difference_m'])} m, "
            f"momentum drift {_number(check['momentum_drift_relative'])}"
        )
        lines += constraint_lines(check)
    return "\n".join(lines + last_lines(summary))


def _observation_lines(observed: dict[str, Any] | None) -> list[str]:
    if observed is None:
        return []
    filtered = f"{observed['used']} of the {observed['filtered']} after the acquisition used"
    lines = [f"  observed      {observed['seen']} poses in {observed['exposures']} exposures, {filtered}"]
    if "predicted_deviation" in observed:
        lines += [
            f"  predicted     within {_sizes(observed['predicted_deviation'])} (root mean square)",
            f"  off by        {_sizes(observed['prediction_error'])}",
        ]
    if observed.get("error_to_true_target"):
        lines.append(f"  true target   missed by {_sizes(observed['error_to_true_target'])}")
    return lines


def _front_lines(front: dict[str, Any] | None) -> list[str]:
    if front is None:
        return []
    lines = [f"  front         {front['solutions']} solutions"]
    for name, entry in front["chosen"].items():
        values = ", ".join(f"{key} {_number(value)}" for key, value in entry["values"].items())
        lines.append(f"    {name:<28}{values}, {entry['duration']:.4g} s")
    return lines


def _sizes(found: dict[str, float | None]) -> str:
    units = ("m", "rad", "m/s", "rad/s")
    return ", ".join(f"{_number(value)} {unit}" for value, unit in zip(found.values(), units, strict=True))


def _number(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.3g}"
