"""The page of the thousand captures: tables in Markdown, and a picture."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.captures.sampling import REASONS
from experiments.captures.work import is_captured
from jffsr.capture.outcome import CaptureCode
from jffsr.viz.save import save_figure
from jffsr.viz.style import WIDTH, legend_above, line_look, new_figure, styled

ERRORS = ("position, m", "attitude, rad", "velocity, m/s", "angular velocity, rad/s")


@dataclass(frozen=True)
class CaptureSet:
    """A set of samples and what came of it: lines of verdicts, of first plans, and of second ones."""

    name: str
    base_mode: str
    verdicts: list[dict]
    first: list[dict]
    again: list[dict]

    @property
    def title(self) -> str:
        """Name and mode of the base."""
        return f"{self.name}, base {self.base_mode.replace('_', ' ')}"

    @property
    def solved(self) -> list[dict]:
        """The line of each capture that was solved, first or second."""
        return [line for line in (*self.first, *self.again) if is_captured(line)]

    @property
    def share(self) -> float:
        """Share of the captures that were solved."""
        return len(self.solved) / len(self.first)


def tables(sets: list[CaptureSet]) -> str:
    """All tables."""
    sets = [one for one in sets if one.first]
    rows = [
        "| set | captures | solved at once | solved in all | s a plan | s a plan tried again |",
        "|---|---|---|---|---|---|",
    ]
    for one in sets:
        count = len(one.first)
        at_once = sum(map(is_captured, one.first))
        alone = f"{np.mean([x['seconds'] for x in one.again]):.2f}" if one.again else "not tried"
        rows.append(
            f"| {one.title} | {count} | {100 * at_once / count:.1f} % | {100 * one.share:.1f} % | "
            f"{np.mean([x['seconds'] for x in one.first]):.3f} | {alone} |"
        )
    parts = ["\n".join(rows), _errors(sets), _rejections(sets), _failures(sets)]
    return "\n\n".join(parts)


def _errors(sets: list[CaptureSet]) -> str:
    rows = [f"| largest error of a solved capture | {' | '.join(ERRORS)} |", "|---|---|---|---|---|"]
    for one in sets:
        largest = np.max([line["errors"] for line in one.solved], axis=0)
        rows.append(f"| {one.title} | {' | '.join(f'{x:.1e}' for x in largest)} |")
    return "\n".join(rows)


def _rejections(sets: list[CaptureSet]) -> str:
    rows = ["| samples | drawn | feasible | " + " | ".join(REASONS) + " |", "|---" * (3 + len(REASONS)) + "|"]
    for name in dict.fromkeys(one.name for one in sets):
        verdicts = next(one.verdicts for one in sets if one.name == name)
        counts = Counter(line["reason"] for line in verdicts)
        share = counts[0] / len(verdicts)
        rejected = " | ".join(str(counts[k + 1]) for k in range(len(REASONS)))
        rows.append(f"| {name} | {len(verdicts)} | {100 * share:.1f} % | {rejected} |")
    return "\n".join(rows)


def _failures(sets: list[CaptureSet]) -> str:
    rows = [
        "| not solved, of which | constraint missed most | captures | earliest, latest time tried last, s | numbers |",
        "|---|---|---|---|---|",
    ]
    for one in sets:
        last = {line["number"]: line for line in (*one.first, *one.again)}
        groups: dict[tuple[str, str], list[dict]] = {}
        for line in last.values():
            if not is_captured(line):
                worst = max(line["violations"], key=line["violations"].get)
                code = CaptureCode(line["code"]).name.lower().replace("_", " ")
                groups.setdefault((code, worst), []).append(line)
        for (code, worst), lines in sorted(groups.items()):
            times = [line["duration"] for line in lines]
            numbers = ", ".join(
                str(line["number"]) for line in sorted(lines, key=lambda line: line["number"])
            )
            rows.append(
                f"| {one.title}: {code} | {worst} | {len(lines)} | {min(times):.1f}, {max(times):.1f} | {numbers} |"
            )
    return "\n".join(rows)


@styled
def draw(path: Path, sets: list[CaptureSet]) -> None:
    """Shares solved over the attempts of the first try, and when the captures take place; a PNG."""
    sets = [one for one in sets if one.first]
    figure = new_figure(2.6, 2 * WIDTH)
    left, right = figure.subplots(1, 2)
    for index, one in enumerate(sets):
        attempts = np.array([line["attempts"] for line in one.first if is_captured(line)])
        counts = np.arange(1, attempts.max() + 1)
        shares = [100 * np.sum(attempts <= count) / len(one.first) for count in counts]
        left.plot(counts, shares, marker=".", **line_look(index))
        durations = [line["duration"] for line in one.solved]
        right.hist(durations, bins=np.arange(15, 61, 3), histtype="step", **line_look(index))
    left.set(xlabel="starts tried", ylabel="captured [%]")
    right.set(xlabel="grasp time [s]", ylabel="captures")
    legend_above(figure, left.lines, [one.title for one in sets])
    save_figure(figure, path.with_suffix(""), ("png",))
