"""The report of a sweep: what was varied, the table, the rank tests, figures, and the best motions."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path

import yaml

from jffsr.errors import InputError
from jffsr.study.sweep.folder import SweepFolder
from jffsr.viz.replay.of_sweep import sweep_replays
from jffsr.viz.report.page import page
from jffsr.viz.report.pictures import figures_block
from jffsr.viz.report.report import made, motion, section, verdict
from jffsr.viz.report.tables import flattened, table

_BEST = (
    "<p>The best point of each of the settings that cost least, computed again from what the sweep kept.</p>"
)


def sweep_report(path: str | Path, figures: Sequence[Path]) -> str:
    """The report of a finished sweep as an HTML document; figures are files of its pictures.

    Raises InputError where the folder holds no finished sweep, or viser is not installed.
    """
    folder = SweepFolder(Path(path))
    summary = folder.read_summary()
    try:
        found = folder.table.read_text(encoding="utf-8")
        text = folder.config.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{folder.path}: cannot be read ({error.strerror or error})") from None
    name = str(summary["name"])
    whole = f"<details><summary>The whole configuration</summary><pre>{escape(text)}</pre></details>"
    varied = {key: value for key, value in yaml.safe_load(text).items() if key != "base"}
    parts = [
        f"<h1>{escape(name)}</h1>",
        '<p class="kind">A sweep of plans</p>',
        verdict(summary["result"]),
        section("What was varied", table(("", ""), list(flattened(varied))) + whole),
        section("What was found", from_markdown(found)),
        section("Figures", figures_block(figures)),
        section("The best motions", _BEST + motion(lambda: sweep_replays(folder.path), name)),
        section("How it was made", made(summary, f"jffsr sweep {folder.config.name}")),
    ]
    return page(name, "\n".join(part for part in parts if part))


def from_markdown(text: str) -> str:
    """Tables and paragraphs of a sweep's table.md as HTML."""
    parts: list[str] = []
    for block in text.strip().split("\n\n"):
        lines = block.splitlines()
        if len(lines) > 2 and all(line.lstrip().startswith("|") for line in lines):
            head, _, *rows = ([cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines)
            parts.append(table(head, [[_value(cell) for cell in row] for row in rows]))
        else:
            parts.append(f"<p>{escape(block.lstrip('# '))}</p>")
    return "\n".join(parts)


def _value(cell: str) -> str | float | int:
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell
