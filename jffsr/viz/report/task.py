"""The task of a study as tables: a row for each joint, and every other number with its unit."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from jffsr.robots.robot import Robot
from jffsr.viz.report.tables import flattened, table
from jffsr.viz.report.units import name_and_unit

_SECTIONS = (
    "robot", "task", "path", "timing", "target", "load", "grasp", "grasp_time", "observation", "limits",
    "constraints", "hold",
)  # fmt: skip
_OF_JOINTS = (
    *(f"task.{end}{unit}" for end in ("start", "goal") for unit in ("", "_deg")),
    *(f"limits.{what}{unit}" for what in ("position", "rate", "acceleration") for unit in ("", "_deg")),
    "limits.torque",
)
"""Keys that the joints' table has in place of the other one."""
_MOST_ROWS = 40
"""Rows that are seen at once; the others are folded away."""
_TURNS, _SLIDES = "turns", "slides"


def task_tables(robot: Robot, config: Mapping[str, Any], varied: Collection[str] = ()) -> str:
    """The joints with start, goal and limits, then what else the task says; `varied` are keys that a sweep sets.

    config is a resolved configuration as plain data; robot has the limits that it is held to.
    """
    return joints_table(robot, config.get("task") or {}, varied) + other_table(config, varied)


def joints_table(robot: Robot, task: Mapping[str, Any], varied: Collection[str] = ()) -> str:
    """A row for each joint: start, goal and limits in degrees where it turns and metres where it slides.

    A column that says nothing of any joint is left out, and so are start and goal where they are varied.
    """
    turning, limits = np.asarray(robot.topology.is_revolute), robot.limits
    length = "deg" if turning.all() else "m" if not turning.any() else "deg or m"
    force = "N m" if turning.all() else "N" if not turning.any() else "N m or N"
    degrees = np.where(turning, np.rad2deg(1.0), 1.0)
    columns: list[tuple[str, Sequence[Any]]] = [("joint", list(robot.joint_names))]
    if length == "deg or m":
        columns.append(("", [_TURNS if turns else _SLIDES for turns in turning]))
    for end in ("start", "goal"):
        found = None if is_varied(f"task.{end}", varied) else _positions(task, end, degrees)
        if found is not None:
            columns.append((f"{end} [{length}]", found))
    for quantity, name, values, factor, unit in (
        ("position", "lower limit", limits.position_lower, degrees, length),
        ("position", "upper limit", limits.position_upper, degrees, length),
        ("rate", "rate limit", limits.velocity, degrees, f"{length}/s"),
        ("acceleration", "acceleration limit", limits.acceleration, degrees, f"{length}/s^2"),
        ("torque", "torque limit", limits.torque, np.ones(len(turning)), force),
    ):
        numbers = np.asarray(values, float) * factor
        if np.any(np.isfinite(numbers)) and not is_varied(f"limits.{quantity}", varied):
            columns.append((f"{name} [{unit}]", [float(x) if np.isfinite(x) else "none" for x in numbers]))
    heads, cells = zip(*columns, strict=True)
    return table(heads, list(zip(*cells, strict=True)))


def other_table(config: Mapping[str, Any], varied: Collection[str] = ()) -> str:
    """What a configuration says of the task besides its joints, a row for each key, with units."""
    wanted = {key: config[key] for key in _SECTIONS if config.get(key) is not None}
    rows = []
    for key, value in flattened(wanted):
        of_joints = any(key == own or key.startswith(f"{own}.") for own in _OF_JOINTS)
        if of_joints or is_varied(key, varied):
            continue
        name, unit = name_and_unit(key)
        rows.append((name.removeprefix("task, "), value, unit))
    heads, rest = ("", "", "unit"), rows[_MOST_ROWS:]
    more = f"<details><summary>{len(rest)} more</summary>{table(heads, rest)}</details>" if rest else ""
    return table(heads, rows[:_MOST_ROWS]) + more


def shows(key: str) -> bool:
    """Whether the tables of a task show the key."""
    return key.partition(".")[0] in _SECTIONS


def is_varied(key: str, varied: Collection[str]) -> bool:
    """Whether a sweep sets the key, in whichever unit, or a part or the whole of it."""
    plain = key.removesuffix("_deg")
    return any(
        plain == other.removesuffix("_deg") or key.startswith(f"{other}.") or other.startswith(f"{plain}.")
        for other in varied
    )


def _positions(task: Mapping[str, Any], end: str, degrees: np.ndarray) -> list[float] | None:
    """Joint positions that a task names, in degrees and m; None where it has none, or not one for each joint."""
    shown, plain = task.get(f"{end}_deg"), task.get(end)
    values = shown if shown is not None else plain
    if not isinstance(values, (list, tuple)) or len(values) != len(degrees):
        return None
    return [float(value) for value in np.asarray(values, float) * (degrees if shown is None else 1.0)]
