"""Several runs beside each other: in what their configurations differ, and what came of each."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import yaml

from jffsr.errors import InputError
from jffsr.study.run_folder import RunFolder
from jffsr.study.sweep.merging import swept_keys
from jffsr.study.sweep.points import expand, value_text
from jffsr.study.sweep.specification import read_sweep
from jffsr.viz.report.tables import OVERRUNS, flattened, head, number, table
from jffsr.viz.report.units import NO_UNIT

_NUMBERS = {
    "cost": "index J",
    "verification.cost_finer": "index J at the finer re-run",
    "duration": "duration [s]",
    "evaluations.objective": "evaluations",
    "evaluations.gradient": "gradients",
    "seconds.total": "seconds in all [s]",
}
"""Numbers that a summary of any kind may have, by their keys in it."""
_PARTS = ("base", "grasp_error", "approach", "contact", "hold", "verification")
_SKIPPED = ("mujoco", "terms_finer", "constraints", "trackers", "runs")
_MOST_ROWS = 60
"""Keys that are seen at once; of more, those that not all runs have are folded away."""
_LONGEST = 160
"""Letters of a configuration's value that a cell shows."""


@dataclass(frozen=True)
class RunRead:
    """What a comparison needs of a finished run or sweep.

    name: what it is called; config: its configuration's values by their keys written with dots; summary: what
    summary.json holds.
    """

    name: str
    config: Mapping[str, Any]
    summary: Mapping[str, Any]


def read_run(path: str | Path, name: str, summary: Mapping[str, Any]) -> RunRead:
    """A finished run or sweep from its folder; of a sweep, keys that it sets have all their values.

    Raises InputError where its configuration cannot be read.
    """
    folder = RunFolder(Path(path))
    if summary["kind"] == "sweep":
        points = expand(read_sweep(str(folder.config)))
        config = dict(flattened(points[0].config.model_dump()))
        for key in swept_keys(points):
            config[key] = list(dict.fromkeys(value_text(p.values[key]) for p in points if key in p.values))
        return RunRead(name, config, summary)
    try:
        found = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise InputError(f"{folder.config}: cannot be read ({error})") from None
    return RunRead(name, dict(flattened(found)) if isinstance(found, Mapping) else {}, summary)


def differences(runs: Sequence[RunRead]) -> str:
    """The configuration's keys in which the runs differ, a column for each run."""
    rows = []
    for key in _in_sections(key for run in runs for key in run.config):
        values = [run.config.get(key) for run in runs]
        if len({json.dumps(value, default=str) for value in values}) > 1:
            rows.append((key, *map(_shown, values)))
    if not rows:
        return "<p>Their configurations are the same.</p>"
    folded = []
    if len(rows) > _MOST_ROWS:
        # Runs of several kinds have sections that the others do not know.
        folded = [row for row in rows if NO_UNIT in row]
        rows = [row for row in rows if NO_UNIT not in row]
    empty = (
        f" {NO_UNIT} is null, empty or not given." if any(NO_UNIT in row for row in (*rows, *folded)) else ""
    )
    words = f"<p>All other keys are the same.{empty}</p>"
    more = f"<details><summary>{len(folded)} keys that only some of them have</summary>" if folded else ""
    more += f"{_beside('key', runs, folded)}</details>" if folded else ""
    return _beside("key", runs, rows) + more + words


def results(runs: Sequence[RunRead]) -> str:
    """What came of each run: its sentence, J, its terms, its cost in evaluations and time, and its verification."""
    columns = [_numbers(run.summary) for run in runs]
    keys = _in_sections(key for column in columns for key in column)
    rows = [
        (_title(key), *(NO_UNIT if column.get(key) is None else column[key] for column in columns))
        for key in keys
        if any(column.get(key) is not None for column in columns)
    ]
    has_overruns = any("overrun" in key for key in keys)
    return _beside("", runs, rows) + (OVERRUNS if has_overruns else "")


def _beside(first: str, runs: Sequence[RunRead], rows: Sequence[Sequence[Any]]) -> str:
    return f'<div class="runs">{table((first, *(run.name for run in runs)), rows)}</div>'


def _in_sections(keys: Iterable[str]) -> list[str]:
    """Keys without repetition, those of one section together, sections and keys in the order of their first use."""
    distinct = {key: key if key in _NUMBERS else key.partition(".")[0] for key in keys}
    sections = list(dict.fromkeys(distinct.values()))
    return sorted(distinct, key=lambda key: sections.index(distinct[key]))


def compared_runs(runs: Sequence[RunRead], curves: str) -> str:
    """All of a comparison as a piece of a page; curves are those drawn together."""
    parts = {
        "In what they differ": differences(runs),
        "What came of them": results(runs),
        "Their curves together": curves,
    }
    return "\n".join(f"<h2>{escape(title)}</h2>\n{part}" for title, part in parts.items() if part)


def _shown(value: Any) -> Any:
    if value is None:
        return NO_UNIT
    text = number(value)
    if isinstance(value, (bool, int, float)):
        return value
    return text if len(text) <= _LONGEST else text[: _LONGEST - 3] + "..."


def _numbers(summary: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers of one run by their keys in its summary, its sentence before them."""
    found: dict[str, Any] = {"result": summary["result"]["sentence"], "robot": summary.get("robot")}
    flat = dict(flattened(summary))
    found |= {key: flat[key] for key in _NUMBERS if key in flat}
    found |= {f"terms.{name}": term["weighted"] for name, term in (summary.get("terms") or {}).items()}
    for place, near in enumerate(summary.get("nearest_approach") or (), 1):
        found[f"nearest_approach.{place}"] = near["sentence"]
    for part in _PARTS:
        section = summary.get(part) or {}
        plain = {key: value for key, value in section.items() if key not in _SKIPPED}
        for key, value in flattened(plain):
            if isinstance(value, (int, float)) and key != "code":
                # Limits and plots are in degrees.
                turn = part == "base" and key.endswith("_rad")
                shown = (key.removesuffix("_rad") + "_deg", math.degrees(value)) if turn else (key, value)
                found[f"{part}.{shown[0]}"] = shown[1]
    return found


def _title(key: str) -> str:
    """What a number of a summary is called, with its unit."""
    if key in _NUMBERS:
        return _NUMBERS[key]
    part, _, name = key.partition(".")
    if part == "terms":
        return f"term {name.replace('_', ' ')}, weighted"
    return head(name if part == "verification" else key)
