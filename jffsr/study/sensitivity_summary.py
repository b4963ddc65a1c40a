"""The sensitivity of a plan in its summary: plain data, and the largest lines of it for the terminal."""

from __future__ import annotations

from typing import Any

import numpy as np

from jffsr.planning.sensitivity import MOMENTS, Sensitivity

_SHOWN = 3
# Unit of each entry in the names of keys.
_UNITS = {"index": "", "attitude": "_rad", "position": "_m", "tool": "_m"}


def sensitivity_summary(found: Sensitivity) -> dict[str, Any]:
    """Plain data: the effect of one percent of each mass and inertia, largest first, and every derivative.

    Keys say the unit: `final_tool_m_per_kg` is a vector in I. An inertia's derivatives stand by element; one
    off the diagonal moves its mirror image along.
    """
    per_percent = []
    for row in found.per_percent:
        entry = {"body": row.body, "quantity": row.quantity, "index": row.index}
        entry |= {"final_attitude_rad": row.attitude, "final_position_m": row.position}
        if row.tool is not None:
            entry["final_tool_m"] = row.tool
        per_percent.append(entry | {"sentence": row.sentence})
    bodies = {}
    for k, body in enumerate(found.bodies):
        values: dict[str, Any] = {"mass_kg": float(found.nominal.mass[k])}
        for name, entry in _entries(found):
            values[f"{name}_per_kg"] = np.asarray(entry.mass[..., k]).tolist()
        values["inertia_kg_m2"] = _by_moment(found.nominal.inertia[k])
        for name, entry in _entries(found):
            values[f"{name}_per_kg_m2"] = _by_moment(np.moveaxis(entry.inertia[..., k, :], -1, 0))
        bodies[body] = values
    return {"end_effector": found.end_effector, "per_percent": per_percent, "bodies": bodies}


def _entries(found: Sensitivity):
    for name, unit in _UNITS.items():
        entry = getattr(found.derivative, name)
        if entry is not None:
            yield (name if name == "index" else f"final_{name}{unit}"), entry


def _by_moment(values: np.ndarray) -> dict[str, Any]:
    return {moment: np.asarray(value).tolist() for moment, value in zip(MOMENTS, values, strict=True)}


def sensitivity_lines(summary: dict[str, Any] | None) -> list[str]:
    """The largest few effects of one percent; nothing where they are unknown or not finite."""
    rows = (summary or {}).get("per_percent", [])
    lines = [row["sentence"] for row in rows[:_SHOWN] if row["final_attitude_rad"] is not None]
    head = "  sensitivity   "
    return [(" " * len(head) if k else head) + line for k, line in enumerate(lines)]
