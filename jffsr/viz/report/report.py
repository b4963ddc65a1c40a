"""The report of a finished run: task, result in words, terms, verification, figures and replay in one page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import date
from html import escape
from pathlib import Path
from typing import Any

import yaml

from jffsr.study.building import build_robot
from jffsr.study.catalogue import robot_text
from jffsr.study.kinds import summary_text
from jffsr.study.run_folder import RunFolder
from jffsr.study.summary import NOT_LOOKED_AT, TORQUE_UNSEEN
from jffsr.viz.replay.reading import replays_of
from jffsr.viz.replay.replay import NothingMoved, Replay
from jffsr.viz.report.page import page
from jffsr.viz.report.pictures import figures_block
from jffsr.viz.report.replay_block import replay_block
from jffsr.viz.report.simulators import simulators_block
from jffsr.viz.report.tables import OVERRUNS, compared, measured, table, terms_table
from jffsr.viz.report.task import task_tables
from jffsr.viz.report.units import NO_UNIT, term_unit

_KINDS = {
    "planning": "A planned motion",
    "tracking": "A path tracked by the tool",
    "capture": "The capture of a tumbling target",
    "reactionless": "A base held still after contact",
    "chain": "From the first picture of a target to a base that is still",
}
_ENDED = {
    "converged": "it had converged",
    "budget": "its budget was used up",
    "target": "its target was reached",
}
_TEXTS, _LONGEST, _WIDTH = (".urdf", ".xml", ".mjcf", ".yaml", ".yml"), 100_000, 110
_TABLES = ("terms_finer", "constraints", "mujoco")
"""Parts of a verification that have tables of their own."""


def run_report(path: str | Path, figures: Sequence[Path]) -> str:
    """The report of a finished run of any kind as an HTML document; figures are files of its pictures.

    Raises InputError where the folder holds no finished run, or viser is not installed.
    """
    folder = RunFolder(Path(path))
    config = yaml.safe_load(folder.config.read_text(encoding="utf-8"))
    summary = folder.read_summary()
    name = str(summary.get("name", folder.path.name))
    kind = f"{_KINDS[summary['kind']]} &middot; robot {escape(str(summary['robot']))}"
    parts = [
        f"<h1>{escape(name)}</h1>",
        f'<p class="kind">{kind}{_where(folder, name)}</p>',
        verdict(summary["result"]),
        caution(summary.get("nearest_approach") == [], summary.get("torque_limits_looked_at") is False),
        section("The motion", motion(lambda: replays_of(folder.path), name)),
        section("The task", _task(config, folder)),
        section("The result", _result(summary, config)),
        section("Verification", _verification(summary)),
        section("Figures", figures_block(figures)),
        section("How it was made", made(summary, f"jffsr run {folder.config.name}")),
    ]
    return page(name, "\n".join(part for part in parts if part))


def _where(folder: RunFolder, name: str) -> str:
    """The folder's name, where it tells this run from others of the same study."""
    own = folder.path.absolute().name
    return "" if own == name else f" &middot; folder {escape(own)}"


def verdict(result: Mapping[str, Any]) -> str:
    """The result in words, marked as met or missed."""
    kind = "met" if result["code"] == 0 else "missed"
    return f'<p class="verdict {kind}">{escape(result["sentence"])}</p>'


def caution(bodies_may_touch: bool, torque_unseen: bool = False) -> str:
    """What a result does not say: whether bodies touch, and torques keep their limits, where nobody asked for it."""
    told = [text for text, so in ((NOT_LOOKED_AT, bodies_may_touch), (TORQUE_UNSEEN, torque_unseen)) if so]
    return "".join(f'<p class="verdict caution">{escape(text[0].upper() + text[1:])}.</p>' for text in told)


def section(title: str, content: str) -> str:
    """A part of the page; nothing where there is nothing in it."""
    return f"<h2>{escape(title)}</h2>\n{content}" if content else ""


def made(summary: Mapping[str, Any], command: str) -> str:
    """How to make it again, what it cost, and with which versions."""
    rows = [("again", f"{command}, which is the whole configuration above")]
    rows += [(name.replace("_", " "), summary[name]) for name in ("seed", "seeds") if name in summary]
    # A path that is tracked without a search has none that ended.
    if (reason := summary.get("search_ended")) is not None:
        ended = _ENDED.get(reason, str(reason))
        enough = "; J was small enough before" if summary.get("evaluations_to_accuracy") else ""
        rows.append(("search ended", ended + enough))
    rows += [
        (f"{what}, {name}", value)
        for what in ("evaluations", "seconds")
        for name, value in (summary.get(what) or {}).items()
    ]
    versions = ", ".join(f"{name} {version}" for name, version in summary.get("versions", {}).items())
    rows += [("versions", versions), ("report written", date.today().isoformat())]
    return table(("", ""), rows)


def motion(find: Callable[[], Sequence[Replay]], name: str) -> str:
    """The replays that `find` returns, or in words why there are none."""
    try:
        return replay_block(find(), name)
    except NothingMoved as error:
        return f"<p>{escape(str(error))}</p>"


def _task(config: Mapping[str, Any], folder: RunFolder) -> str:
    text = escape(folder.config.read_text(encoding="utf-8"))
    whole = f"<details><summary>The whole configuration</summary><pre>{text}</pre></details>"
    return task_tables(build_robot(folder.read_config()), config) + whole + _robot(folder)


def _robot(folder: RunFolder) -> str:
    """The robot in full, and the text of the files of one that is not of the catalogue, folded away."""
    parts = [robot_text(str(folder.read_config().robot), _WIDTH)]
    for file in sorted((folder.path / "robot").rglob("*")):
        if file.suffix.lower() in _TEXTS and file.stat().st_size < _LONGEST:
            name = file.relative_to(folder.path).as_posix()
            parts.append(f"{name}\n\n{file.read_text(encoding='utf-8', errors='replace')}")
    blocks = "".join(f"<pre>{escape(part)}</pre>" for part in parts)
    return f"<details><summary>The robot</summary>{blocks}</details>"


def _result(summary: Mapping[str, Any], config: Mapping[str, Any]) -> str:
    terms = summary.get("terms") or {}
    finer = summary["verification"].get("terms_finer", {})
    parts = [terms_table(terms, finer, scales(config.get("objective") or {}, terms))]
    parts += [compared(summary[what]) for what in ("trackers", "runs") if summary.get(what)]
    printed = f"<pre>{escape(summary_text(dict(summary)))}</pre>"
    return "\n".join(part for part in [*parts, printed] if part)


def scales(objective: Mapping[str, Any], terms: Mapping[str, Any]) -> dict[str, str]:
    """Which value of each term counts 1, with its unit, by the section `objective` of a configuration."""
    found = {}
    for name, term in terms.items():
        section = objective.get(name)
        if not isinstance(section, Mapping):
            continue
        if section.get("scale_deg") is not None:
            found[name] = f"{section['scale_deg']:g} deg"
        elif section.get("scale") is not None:
            unit = term_unit(name, term)
            found[name] = f"{section['scale']:g}" + (f" {unit}" if unit != NO_UNIT else "")
    return found


def _verification(summary: Mapping[str, Any]) -> str:
    """What the finer re-run and the other simulators found; the terms have a table of their own."""
    found = summary["verification"]
    rest = {key: value for key, value in found.items() if key not in _TABLES}
    if "cost_finer" in rest:
        rest = {"index J at the finer re-run": rest.pop("cost_finer")} | rest
    if summary["kind"] == "tracking" and "momentum_drift" in rest:
        rest["momentum_drift_relative"] = rest.pop("momentum_drift")
    constraints = [
        (name.replace("_", " "), part["violation"], part["tolerance"], part.get("unit") or NO_UNIT)
        for name, part in (found.get("constraints") or {}).items()
    ]
    simulators = found.get("mujoco")
    return (
        measured(rest)
        + (OVERRUNS if "largest_overrun_relative" in rest else "")
        + table(("constraint", "missed by", "allowed", "unit"), constraints)
        + ("" if simulators is None else simulators_block(simulators))
    )
