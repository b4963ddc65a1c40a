"""The report of a sweep: its best setting, what was varied and fixed, what was found, and the best motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.planning.result import torque_unseen
from jffsr.study.building import build_problem, build_robot
from jffsr.study.dataset import open_dataset
from jffsr.study.schema import PlanningConfig
from jffsr.study.sweep.ended import read_ended
from jffsr.study.sweep.folder import SweepFolder
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.sweep.table import keys_of
from jffsr.viz.replay.of_sweep import sweep_replays
from jffsr.viz.report.page import page
from jffsr.viz.report.pictures import figures_block
from jffsr.viz.report.report import caution, made, motion, section, verdict
from jffsr.viz.report.sweep_findings import best_setting, binding_table, short_points, varied_table
from jffsr.viz.report.tables import flattened, table
from jffsr.viz.report.task import is_varied, other_table, shows, task_tables

_BEST = (
    "<p>The best point of each of the settings that cost least, computed again from what the sweep kept.</p>"
)


def sweep_report(path: str | Path, figures: Sequence[Path]) -> str:
    """The report of a sweep that came to its end as an HTML document; figures are files of its pictures.

    Raises InputError where the folder holds no such sweep, or viser is not installed.
    """
    folder = SweepFolder(Path(path))
    summary = read_ended(path)
    try:
        found = folder.table.read_text(encoding="utf-8")
        text = folder.config.read_text(encoding="utf-8")
        dataset = open_dataset(folder.result)
    except OSError as error:
        raise InputError(f"{folder.path}: cannot be read ({error.strerror or error})") from None
    name, first = str(summary["name"]), expand(read_sweep(str(folder.config)))[0].config
    # A robot of one's own lies in the folder, wherever that is now.
    own = Path(first.robot)
    own = own.relative_to(folder.path.absolute()) if own.is_relative_to(folder.path.absolute()) else own
    varied = keys_of(dataset, seeds=True)
    robot = "" if "robot" in varied else f" &middot; robot {escape(own.stem)}"
    touched = first.trajectory.keeps_position and not is_varied("trajectory.kind", varied)
    by_law = ("position",) if touched else ()
    torque = torque_unseen(build_problem(first)) and not any(
        is_varied(key, varied)
        for key in ("limits.torque", "objective.joint_torque", "constraints.torque_limit")
    )
    whole = f"<details><summary>The whole configuration</summary><pre>{escape(text)}</pre></details>"
    parts = [
        f"<h1>{escape(name)}</h1>",
        f'<p class="kind">A sweep of plans{robot}</p>',
        verdict(summary["result"]),
        caution(first.constraints.clearance is None and "constraints.clearance.margin" not in varied, torque),
        best_setting(dataset),
        section("What was varied", varied_table(dataset)),
        section("What was fixed", fixed(first, varied, str(own)) + whole),
        section("What was found", from_markdown(found)),
        section("What binds", binding_table(dataset, by_law)),
        section("Points that fell short", short_points(dataset)),
        section("Figures", figures_block(figures)),
        section("The best motions", _BEST + motion(lambda: sweep_replays(folder.path), name)),
        section("How it was made", made(summary, f"jffsr sweep {folder.config.name}")),
    ]
    return page(name, "\n".join(part for part in parts if part))


def fixed(config: PlanningConfig, varied: Sequence[str], robot: str | None = None) -> str:
    """What all points of a sweep share: the joints' start, goal and limits, the task, and folded away all the rest.

    robot is what the robot is called here, if not as in the configuration.
    """
    values = {**_plain(config.model_dump()), "robot": robot or config.robot}
    shown = (
        other_table(values, varied) if "robot" in varied else task_tables(build_robot(config), values, varied)
    )
    rest = [
        (key, value)
        for key, value in flattened(values)
        if not shows(key) and not is_varied(key, varied) and key not in ("kind", "name")
    ]
    more = table(("", ""), rest)
    return f"{shown}<details><summary>Everything else that was fixed</summary>{more}</details>"


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


def _plain(value: Any) -> Any:
    """Mappings and lists all the way down, as YAML would have them."""
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value


def _value(cell: str) -> str | float | int:
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell
