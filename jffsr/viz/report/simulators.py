"""What other simulators said of a motion, as `jffsr check` wrote it into the summary of each kind of run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from jffsr.viz.report.tables import table

_ENGINES = {
    "mujoco": "MuJoCo",
    "mjx": "MJX",
    "forces": "MuJoCo, by torques and impulses",
    "momentum": "MuJoCo, by the momentum equation",
}
_ENGINE = (
    ("step", "step [ms]", 1e3),
    ("attitude", "base attitude [rad]", 1.0),
    ("position", "base position [m]", 1.0),
)
_PLANNED = (
    *_ENGINE,
    ("tracking", "joints [rad or m]", 1.0),
    ("momentum_linear", "linear momentum [N s]", 1.0),
    ("momentum_angular", "angular momentum [N m s]", 1.0),
    ("compile_seconds", "compiling [s]", 1.0),
    ("run_seconds", "running [s]", 1.0),
)
_TRACKED = (
    *_ENGINE,
    ("tool_attitude", "tool attitude [rad]", 1.0),
    ("tool_position", "tool position [m]", 1.0),
    ("tracking", "joints [rad or m]", 1.0),
    ("momentum_linear", "linear momentum [relative]", 1.0),
    ("momentum_angular", "angular momentum [relative]", 1.0),
    ("run_seconds", "running [s]", 1.0),
)
_HELD = (
    ("base_rate", "base rate at the end, MuJoCo [rad/s]", 1.0),
    ("ours", "the same, ours [rad/s]", 1.0),
    ("attitude", "base attitude apart [rad]", 1.0),
    ("joints", "joints apart [rad or m]", 1.0),
    ("momentum", "momentum apart [N s, N m s]", 1.0),
)
_CAPTURED = (
    ("tool_position", "tool at the end", "m"),
    ("tool_attitude", "tool's attitude at the end", "rad"),
    ("target_position", "target at the end", "m"),
    ("target_attitude", "target's attitude at the end", "rad"),
    ("tracking", "joints", "rad or m"),
)
_LARGEST = "<p>Largest differences between our motion and the simulator's.</p>"


def simulators_block(found: Mapping[str, Any]) -> str:
    """The verdict, and the numbers behind it in a table; found is the summary's `verification.mujoco`."""
    kind = "met" if found.get("passed") else "missed"
    words = f'<p class="verdict {kind}">{escape(str(found.get("sentence", "")))}</p>'
    comparisons = found.get("comparisons")
    if comparisons:
        way = "way" if "way" in comparisons[0] else "engine"
        columns = _TRACKED if way == "way" else _PLANNED
        names = [_ENGINES.get(str(entry[way]), str(entry[way])) for entry in comparisons]
        return words + _LARGEST + _rows("simulator", names, comparisons, columns)
    runs = found.get("runs")
    if runs:
        return words + _rows("run", list(runs), list(runs.values()), _HELD)
    rows = [(name, found[key], unit) for key, name, unit in _CAPTURED if found.get(key) is not None]
    rows += [
        (f"{' and '.join(contact['pair'])} touch at {contact['time']:.4g} s", contact["depth"], "m deep")
        for contact in found.get("contacts") or ()
    ]
    steps = (
        f"<p>{found['duration']:.4g} s in steps of {1e3 * found['step']:.4g} ms.</p>"
        if "step" in found
        else ""
    )
    return words + steps + table(("", "difference", "unit"), rows)


def _rows(
    first: str,
    names: Sequence[str],
    entries: Sequence[Mapping[str, Any]],
    columns: Sequence[tuple[str, str, float]],
) -> str:
    """A row for each entry; columns are (key, head, factor), those that no entry has are left out."""
    used = [column for column in columns if any(entry.get(column[0]) is not None for entry in entries)]
    rows = [
        (name, *(None if entry.get(key) is None else factor * entry[key] for key, _, factor in used))
        for name, entry in zip(names, entries, strict=True)
    ]
    return table((first, *(title for _, title, _ in used)), rows)
