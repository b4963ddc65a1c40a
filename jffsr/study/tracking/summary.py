"""The summary of a tracking study: what summary.json holds and what the command line prints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from jffsr.optimizers.driver import Outcome
from jffsr.study.summary import last_lines, versions
from jffsr.study.tracking.building import TrackingTask
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.study.tracking.tracked_path import TrackedPath
from jffsr.tracking.outcome import TrackingCode

_IMPOSSIBLE = (TrackingCode.UNREACHABLE, TrackingCode.THROUGH_BASE, TrackingCode.NOT_FINITE)
_NUMBERS = ("lambda_max", "epsilon", "damping", "threshold", "position_gain", "attitude_gain")


def tracking_summary(
    config: TrackingConfig,
    task: TrackingTask,
    paths: Mapping[str, TrackedPath],
    searched: Outcome | None,
    seconds: Mapping[str, float],
) -> dict[str, Any]:
    """The summary, plain data; a comparison that is finished is met, whatever became of each tracker."""
    label, judged = list(paths.items())[-1]
    result = {
        "code": int(judged.result.code),
        "name": judged.result.code.name.lower(),
        "sentence": judged.result.sentence,
    }
    # A limit that is broken or a path that is lost is what a comparison is to show; a path that nobody can go is not.
    if config.compare and not all(path.result.code in _IMPOSSIBLE for path in paths.values()):
        result = {"code": 0, "name": "compared", "sentence": f"{len(paths)} trackers compared on one path"}
    return {
        "kind": "tracking",
        "name": config.name,
        "robot": task.robot.name,
        "result": result,
        "cost": float(judged.published) if searched is None else searched.best_value,
        "terms": {name: {"value": value, "weighted": value} for name, value in _errors(judged).items()},
        "judged": label,
        "duration": float(task.target.duration),
        "evaluations": {
            "objective": 0 if searched is None else searched.evaluations,
            "gradient": 0 if searched is None else searched.gradient_evaluations,
        },
        "tuned": [] if config.tuning is None else list(config.tuning.parameters),
        "search_ended": None if searched is None else searched.reason,
        "seconds": dict(seconds),
        "seed": config.seed,
        "versions": versions(),
        "verification": _verification(judged),
        "trackers": {label: _tracker(path) for label, path in paths.items()},
        "singularities": {
            label: path.singularities.to_dict()
            for label, path in paths.items()
            if path.singularities is not None
        },
        "singularities_text": None if judged.singularities is None else judged.singularities.to_text(),
    }


def _errors(path: TrackedPath) -> dict[str, float]:
    return {name: float(value) for name, value in path.errors._asdict().items()}


def _tracker(path: TrackedPath) -> dict[str, Any]:
    tracked, tracker = path.tracked, path.tracker
    return {
        "method": tracker.method,
        "numbers": {name: float(np.asarray(getattr(tracker, name))) for name in _NUMBERS},
        "result": {
            "code": int(path.result.code),
            "name": path.result.code.name.lower(),
            "sentence": path.result.sentence,
        },
        "published_index": float(path.published),
        "pose_errors": _errors(path),
        "peak_rate": float(path.peak_rate),
        "smallest_singular_value": float(np.min(tracked.singular_values)),
        "limited_share": float(np.mean(tracked.limited)),
        "verification": _verification(path),
    }


def _verification(path: TrackedPath) -> dict[str, Any]:
    found = path.verification
    return {field.name: np.asarray(getattr(found, field.name)).tolist() for field in fields(found)}


def summary_text(summary: dict[str, Any]) -> str:
    """A summary for the terminal."""
    lines = [f"{summary['name']}: {summary['result']['sentence']}", ""]
    width = max(22, *(len(label) + 2 for label in summary["trackers"]))
    heads = ("position mm", "attitude deg", "end mm", "end deg", "B", "rate deg/s", "sigma min")
    lines.append(f"  {'tracker':<{width}}" + "".join(f"{head:>13}" for head in heads))
    for label, tracker in summary["trackers"].items():
        errors = tracker["pose_errors"]
        cells = (
            _scaled(errors["position_peak"], 1e3),
            _scaled(errors["attitude_peak"], 180 / np.pi),
            _scaled(errors["position_end"], 1e3),
            _scaled(errors["attitude_end"], 180 / np.pi),
            _scaled(tracker["published_index"], 1.0),
            _scaled(tracker["peak_rate"], 180 / np.pi),
            _scaled(tracker["smallest_singular_value"], 1.0),
        )
        lines.append(f"  {label:<{width}}" + "".join(f"{cell:>13}" for cell in cells))
    if len(summary["trackers"]) > 1:
        lines.append("")
        for label, tracker in summary["trackers"].items():
            lines.append(f"  {label}: {tracker['result']['sentence']}")
    counts = summary["evaluations"]
    if counts["objective"] or counts["gradient"]:
        own = summary["trackers"][summary["judged"]]["numbers"]
        numbers = ", ".join(f"{name} {own[name]:.4g}" for name in summary["tuned"])
        lines += ["", f"  tuned         index {summary['cost']:.4g} after {counts['objective']} paths and "]
        lines[-1] += f"{counts['gradient']} gradients: {numbers}"
    check = summary["verification"]
    lines += [
        "",
        f"  finer re-run  tool {_scaled(check['tool_position_difference'], 1.0)} m, "
        f"{_scaled(check['tool_attitude_difference'], 1.0)} rad; momentum drift "
        f"{_scaled(check['momentum_drift'], 1.0)}",
    ]
    if summary.get("singularities_text"):
        lines += ["", *(f"  {line}" for line in summary["singularities_text"].splitlines())]
    return "\n".join(lines + last_lines(summary))


def _scaled(value: float | None, factor: float) -> str:
    return "not finite" if value is None else f"{factor * value:.4g}"
