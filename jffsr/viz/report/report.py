"""The report of a finished run: task, result in words, terms, verification, figures and replay in one page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import yaml

from jffsr.study.kinds import summary_text
from jffsr.study.run_folder import RunFolder
from jffsr.viz.replay.reading import replays_of
from jffsr.viz.replay.replay import NothingMoved, Replay
from jffsr.viz.report.page import page
from jffsr.viz.report.pictures import figures_block
from jffsr.viz.report.replay_block import replay_block
from jffsr.viz.report.tables import compared, flattened, measured, table, terms_table

_KINDS = {
    "planning": "A planned motion",
    "tracking": "A path tracked by the tool",
    "capture": "The capture of a tumbling target",
    "reactionless": "A base held still after contact",
    "chain": "From the first picture of a target to a base that is still",
}
_TASK = ("robot", "task", "path", "target", "load", "grasp_time", "limits", "constraints", "hold")
_MOST_ROWS = 30


def run_report(path: str | Path, figures: Sequence[Path]) -> str:
    """The report of a finished run of any kind as an HTML document; figures are files of its pictures.

    Raises InputError where the folder holds no finished run, or viser is not installed.
    """
    folder = RunFolder(Path(path))
    config = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    summary = folder.read_summary()
    name = str(summary.get("name", folder.path.name))
    parts = [
        f"<h1>{escape(name)}</h1>",
        f'<p class="kind">{_KINDS[summary["kind"]]} &middot; robot {escape(str(summary["robot"]))}</p>',
        verdict(summary["result"]),
        section("The motion", motion(lambda: replays_of(folder.path), name)),
        section("The task", _task(config, folder)),
        section("The result", _result(summary)),
        section("Verification", _verification(summary["verification"])),
        section("Figures", figures_block(figures)),
        section("How it was made", made(summary, f"jffsr run {folder.config.name}")),
    ]
    return page(name, "\n".join(part for part in parts if part))


def verdict(result: Mapping[str, Any]) -> str:
    """The result in words, marked as met or missed."""
    kind = "met" if result["code"] == 0 else "missed"
    return f'<p class="verdict {kind}">{escape(result["sentence"])}</p>'


def section(title: str, content: str) -> str:
    """A part of the page; nothing where there is nothing in it."""
    return f"<h2>{escape(title)}</h2>\n{content}" if content else ""


def made(summary: Mapping[str, Any], command: str) -> str:
    """How to make it again, what it cost, and with which versions."""
    rows = [("again", command)]
    rows += [
        (name.replace("_", " "), summary[name])
        for name in ("seed", "seeds", "search_ended")
        if name in summary
    ]
    rows += [
        (f"{what}, {name}", value)
        for what in ("evaluations", "seconds")
        for name, value in (summary.get(what) or {}).items()
    ]
    versions = ", ".join(f"{name} {version}" for name, version in summary.get("versions", {}).items())
    return table(("", ""), [*rows, ("versions", versions)])


def motion(find: Callable[[], Sequence[Replay]], name: str) -> str:
    """The replays that `find` returns, or in words why there are none."""
    try:
        return replay_block(find(), name)
    except NothingMoved as error:
        return f"<p>{escape(str(error))}</p>"


def _task(config: Mapping[str, Any], folder: RunFolder) -> str:
    wanted = {key: config[key] for key in _TASK if config.get(key) not in (None, {}, [])}
    rows = list(flattened(wanted))
    text = escape(folder.config.read_text(encoding="utf-8"))
    whole = f"<details><summary>The whole configuration</summary><pre>{text}</pre></details>"
    return table(("", ""), rows[:_MOST_ROWS]) + whole


def _result(summary: Mapping[str, Any]) -> str:
    parts = [terms_table(summary.get("terms") or {}, summary["verification"].get("terms_finer", {}))]
    parts += [compared(summary[what]) for what in ("trackers", "runs") if summary.get(what)]
    printed = f"<pre>{escape(summary_text(dict(summary)))}</pre>"
    return "\n".join(part for part in [*parts, printed] if part)


def _verification(found: Mapping[str, Any]) -> str:
    """What the finer re-run and the other simulators found; the terms have a table of their own."""
    simulators = found.get("mujoco")
    rest = {key: value for key, value in found.items() if key not in ("terms_finer", "mujoco")}
    if simulators is None:
        return measured(rest)
    lines = [
        line
        for part in simulators.values()
        if isinstance(part, list)
        for line in part
        if isinstance(line, dict)
    ]
    columns = list(dict.fromkeys(key for line in lines for key in line))
    rows = [[line.get(key) for key in columns] for line in lines]
    words = f"<p>{escape(str(simulators.get('sentence', '')))}</p>"
    return measured(rest) + words + table([key.replace("_", " ") for key in columns], rows)
