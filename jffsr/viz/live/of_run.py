"""What a run's folder tells while the run is under way."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.study.run_folder import RunFolder
from jffsr.viz.live.growing import GrowingLines
from jffsr.viz.live.news import Chart, News, Table, ago, changed_at, curve, ending

if TYPE_CHECKING:
    from jffsr.viz.replay.replay import Replay

_ROWS = 12


class RunWatch:
    """Looks into the folder of a run of any kind; InputError where it is none."""

    def __init__(self, path: Path):
        self._folder = RunFolder(path)
        config = self._folder.read_config()
        self.name, self.kind = config.name, config.kind
        self._lines = GrowingLines(self._folder.metrics)

    def news(self) -> News:
        """How the run stands now."""
        folder, rows = self._folder, self._lines.look()
        last = changed_at(folder.metrics, folder.checkpoint, folder.summary)
        facts = [("kind", self.kind), ("begun", ago(changed_at(folder.config))), ("last news", ago(last))]
        searched = [row for row in rows if "best_value" in row]
        charts: tuple[Chart, ...] = ()
        table = None
        if searched:
            facts += _search_facts(searched)
            charts = _search_charts(searched)
        elif rows:
            table = _table(rows)
        hint = f"jffsr show {folder.path}" if folder.finished else ""
        return News(self._headline(bool(rows)), folder.finished, tuple(facts), charts, table, hint=hint)

    @property
    def has_motion(self) -> bool:
        """Whether there may be a motion to look at before the run is finished."""
        return self.kind == "planning" and self._folder.checkpoint.is_file()

    def motion(self) -> Replay:
        """The best motion so far; InputError where there is none."""
        from jffsr.viz.live.best_motion import best_replay

        return best_replay(self._folder.path)

    def _headline(self, begun: bool) -> str:
        folder = self._folder
        if folder.finished:
            return ending(folder)
        if begun:
            return "under way"
        return "under way, and has noted nothing yet" if folder.config.is_file() else "its folder is gone"


def _search_facts(rows: list[dict[str, Any]]) -> list[tuple[str, str]]:
    last = rows[-1]
    best, missed = _number(last["best_value"]), _number(last.get("violation", 0.0))
    facts = [
        ("phase", str(last.get("phase", "-"))),
        ("best J", f"{best:.6g}" if np.isfinite(best) else "none yet"),
        ("evaluations", str(last.get("evaluations", "-"))),
        ("gradients", str(last.get("gradient_evaluations", "-"))),
    ]
    if "violation" in last:
        facts.insert(2, ("constraints missed by", f"{missed:.3g}" if np.isfinite(missed) else "-"))
    return facts


def _search_charts(rows: list[dict[str, Any]]) -> tuple[Chart, ...]:
    used = [_number(row.get("evaluations")) + _number(row.get("gradient_evaluations", 0)) for row in rows]
    axis = "evaluations and gradients"
    best = curve("best J", axis, "best J", used, [_number(row["best_value"]) for row in rows])
    missed = None
    if any("violation" in row for row in rows):
        violation = [_number(row.get("violation")) for row in rows]
        missed = curve("constraints missed by", axis, "violation", used, violation)
    return tuple(chart for chart in (best, missed) if chart is not None)


def _table(rows: list[dict[str, Any]]) -> Table:
    """What a run without a search has noted, latest last."""
    shown = rows[-_ROWS:]
    names = list(
        dict.fromkeys(name for row in shown for name in row if not isinstance(row[name], dict | list))
    )
    lines = tuple(tuple(_word(row.get(name)) for name in names) for row in shown)
    return Table(tuple(name.replace("_", " ") for name in names), lines, len(rows) - len(shown))


def _word(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _number(value: Any) -> float:
    """A number of a line, which has null for what is not finite."""
    return float(value) if isinstance(value, int | float) else np.nan
