"""What a sweep's folder tells while the sweep is under way."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jffsr.errors import InputError
from jffsr.planning.result import ResultCode
from jffsr.study.sweep.folder import SweepFolder
from jffsr.study.sweep.parts import read_part
from jffsr.study.sweep.points import expand, value_text
from jffsr.study.sweep.specification import read_sweep
from jffsr.viz.live.news import Chart, News, Table, ago, changed_at, curve, ending

if TYPE_CHECKING:
    from jffsr.viz.replay.replay import Replay

_ROWS = 20


class _Found(NamedTuple):
    """One finished point: when it was written, its code, and J where it counts, else infinite."""

    instant: float
    code: int
    cost: float


class SweepWatch:
    """Looks into a sweep's folder; InputError where it is none. It reads and writes nothing else."""

    kind = "sweep"
    has_motion = False

    def __init__(self, path: Path):
        self._folder = SweepFolder(path)
        spec = read_sweep(str(self._folder.config))
        self.name = spec.name
        points = expand(spec)
        self._count = len(points)
        # The seeds of a setting are one group.
        self._groups: dict[str, list[int]] = {}
        for point in points:
            values = {key: value for key, value in point.values.items() if key != "seed"}
            label = ", ".join(f"{key}={value_text(value)}" for key, value in values.items()) or "all seeds"
            self._groups.setdefault(label, []).append(point.number)
        self._seen: dict[str, float] = {}
        self._found: dict[int, _Found] = {}

    def news(self) -> News:
        """How the sweep stands now."""
        self._look()
        folder, done = self._folder, len(self._found)
        met = sum(found.code == ResultCode.ACCURACY_MET for found in self._found.values())
        begun, last = changed_at(folder.config), max((f.instant for f in self._found.values()), default=None)
        facts = [
            ("points", str(self._count)),
            ("finished", f"{done}, of which {met} met their accuracy and {done - met} did not"),
            ("still to come", str(self._count - done)),
            ("begun", ago(begun)),
            ("last news", ago(changed_at(folder.summary) or last)),
        ]
        damaged = sum(1 for _ in folder.parts.glob("*.damaged"))
        if damaged:
            facts.append(("damaged parts", f"{damaged}, computed again"))
        return News(
            self._headline(done),
            folder.finished,
            tuple(facts),
            self._charts(begun),
            self._table(),
            done / self._count,
            hint=f"jffsr show {folder.path}" if folder.finished else "",
        )

    def motion(self) -> Replay:
        """None is kept before the sweep is finished."""
        raise InputError(f"{self._folder.path}: a sweep keeps no motion while it is under way")

    def _look(self) -> None:
        """Read the parts that are new; one that cannot be read is another look's."""
        there = {}
        for path in self._folder.parts.glob("*.npz"):
            instant = changed_at(path)
            if instant is not None:
                there[path] = instant
        if any(path.name in self._seen and self._seen[path.name] != at for path, at in there.items()) or len(
            there
        ) < len(self._seen):
            self._seen, self._found = {}, {}
        for path, instant in there.items():
            if path.name in self._seen:
                continue
            try:
                part, _ = read_part(path)
                found = _points(part.results, instant)
            except Exception:
                # It may be half gone, or of another version: what does not count is not done.
                continue
            self._seen[path.name] = instant
            self._found.update(zip(part.numbers, found, strict=True))

    def _headline(self, done: int) -> str:
        folder = self._folder
        if folder.finished:
            return ending(folder)
        if folder.result.is_file() and done < self._count:
            # Merged without a summary: an attempt came to its end with points missing.
            return (
                f"{self._count - done} points could not be computed so far; the same command tries them again"
            )
        return "under way" if done else "under way, no point is finished yet"

    def _charts(self, begun: float | None) -> tuple[Chart, ...]:
        ordered = sorted(self._found.values(), key=lambda found: found.instant)
        if not ordered:
            return ()
        instants = np.array([found.instant for found in ordered])
        start = instants[0] if begun is None else min(begun, instants[0])
        count = np.arange(len(ordered) + 1.0)
        unit, size = _unit(instants[-1] - start)
        since = np.concatenate([[0.0], (instants - start) / size])
        finished = curve("finished points", f"{unit} since the sweep began", "finished", since, count)
        best = np.minimum.accumulate([found.cost for found in ordered])
        found = curve("best J so far", "finished points", "best J", count[1:], best)
        return tuple(chart for chart in (finished, found) if chart is not None)

    def _table(self) -> Table:
        rows = []
        for label, numbers in self._groups.items():
            found = [self._found[number] for number in numbers if number in self._found]
            best = min((point.cost for point in found), default=np.inf)
            met = sum(point.code == ResultCode.ACCURACY_MET for point in found)
            words = f"{best:.4g}" if np.isfinite(best) else "-"
            rows.append((best, (label, f"{len(found)} of {len(numbers)}", str(met), words)))
        if len(rows) > _ROWS:
            rows.sort(key=lambda row: row[0])
        shown = tuple(words for _, words in rows[:_ROWS])
        return Table(("setting", "finished", "met", "best J"), shown, len(rows) - len(shown))


def _points(results: dict[str, np.ndarray], instant: float) -> list[_Found]:
    """The points of a part; as in the merged table, J counts where it is finite and all constraints are kept."""
    code, cost = np.asarray(results["code"]), np.asarray(results["cost"], float)
    met = (
        np.isfinite(results["history_best_value"]).any(axis=1) if results["history_best_value"].size else True
    )
    counts = np.isfinite(cost) & (code != ResultCode.CONSTRAINTS_VIOLATED) & met
    costs = np.where(counts, cost, np.inf)
    return [_Found(instant, int(c), float(j)) for c, j in zip(code, costs, strict=True)]


def _unit(seconds: float) -> tuple[str, float]:
    return ("hours", 3600.0) if seconds > 7200 else ("minutes", 60.0) if seconds > 300 else ("seconds", 1.0)
