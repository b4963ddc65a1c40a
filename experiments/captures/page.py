"""The page of the thousand captures: tables in Markdown, and a picture."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.captures.sampling import REASONS
from experiments.captures.work import is_captured
from jffsr.capture.outcome import CaptureCode

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
        "| set | captures | solved at once | solved in all | s a plan, in batches | s a plan, tried again alone |",
        "|---|---|---|---|---|---|",
    ]
    for one in sets:
        count = len(one.first)
        at_once = sum(map(is_captured, one.first))
        alone = f"{np.median([x['seconds'] for x in one.again]):.2f}" if one.again else "-"
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
        "| not solved | number | what became of it | constraint missed most, and by how much |",
        "|---|---|---|---|",
    ]
    for one in sets:
        last = {line["number"]: line for line in (*one.first, *one.again)}
        for number, line in sorted(last.items()):
            if not is_captured(line):
                worst, missed = max(line["violations"].items(), key=lambda item: item[1])
                code = CaptureCode(line["code"]).name.lower().replace("_", " ")
                rows.append(f"| {one.title} | {number} | {code} | {worst}, {missed:.2g} |")
    return "\n".join(rows)


def draw(path: Path, sets: list[CaptureSet]) -> None:
    """Shares solved over the attempts, and when the captures take place."""
    import matplotlib.pyplot as plt

    from jffsr.viz.save import save_figure

    sets = [one for one in sets if one.first]
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.4), layout="constrained")
    for one in sets:
        attempts = np.sort([line["attempts"] if is_captured(line) else np.inf for line in one.first])
        share = np.arange(1, len(attempts) + 1) / len(attempts)
        left.step(
            [*attempts[np.isfinite(attempts)]],
            100 * share[np.isfinite(attempts)],
            where="post",
            label=one.title,
        )
        right.hist(
            [line["duration"] for line in one.solved],
            bins=np.arange(15, 61, 3),
            histtype="step",
            label=one.title,
        )
    left.set(xlabel="attempts", ylabel="captures solved (%)", ylim=(0, 101))
    right.set(xlabel="grasp time (s)", ylabel="captures")
    left.legend(frameon=False)
    save_figure(figure, path)
