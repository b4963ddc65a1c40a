"""Recorded chains run again with the joints' ranges in the reference, beside what became of them without.

`python -m experiments.chain --seeds 16,23 --folder runs/chain_ranges` runs some of them again, and
`python -m experiments.chain.ranges --folder runs/chain_ranges` puts what is found there into the page.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from experiments.captures.work import read_lines
from experiments.chain.page import line
from experiments.pages import fill
from jffsr.study.chain.outcome import ChainCode

BEGIN, END = "<!-- with ranges: begin -->", "<!-- with ranges: end -->"
PAGE = Path("docs/benchmarks/chain.md")
RECORDED, AGAIN = PAGE.with_suffix(".jsonl"), PAGE.with_name("chain_ranges.jsonl")
_GROUPS = (
    (ChainCode.NOT_HELD, "a joint left its range"),
    (ChainCode.HELD, "grasped and held"),
)


def found_in(folder: Path) -> dict[int, dict]:
    """A line of every finished chain in a folder, by its number."""
    lines = {}
    for file in sorted(folder.glob("[0-9]*/summary.json")):
        summary, number = json.loads(file.read_text(encoding="utf-8")), int(file.parent.name)
        lines[number] = {"number": number} | line(summary)
    return lines


def tables(recorded: dict[int, dict], again: dict[int, dict]) -> str:
    """What became of those that were run again, by what had become of them; rates and angles before and after."""
    heads = (
        "without the ranges",
        "of these run again",
        "with them held",
        "a joint left its range",
        "ended otherwise",
        "base rate at the end, mrad/s, median without, with",
        "base turned by, deg, median without, with",
        "most of a range used",
    )
    rows = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for code, words in _GROUPS:
        before = [old for old in recorded.values() if old["code"] == code]
        pairs = [(old, again[old["number"]]) for old in before if old["number"] in again]
        codes = [new["code"] for _, new in pairs]
        held, left = codes.count(ChainCode.HELD), codes.count(ChainCode.NOT_HELD)
        both = [(old, new) for old, new in pairs if "base_rate" in new]
        cells = [
            f"{words}: {len(before)}",
            f"{len(pairs)}",
            f"{held}",
            f"{left}",
            f"{len(codes) - held - left}",
            _medians(both, "base_rate", 1e3),
            _medians(both, "turned", np.rad2deg(1.0)),
            f"{max(new['range_used'] for _, new in both):.3f}" if both else "",
        ]
        rows.append(f"| {' | '.join(cells)} |")
    other = [f"{new['number']}: {new['sentence']}" for new in again.values() if new["code"] != ChainCode.HELD]
    return "\n".join(
        [*rows, *(["", "Those not held:", ""] + [f"* {text}" for text in other] if other else [])]
    )


def _medians(pairs: list[tuple[dict, dict]], key: str, scale: float) -> str:
    if not pairs:
        return ""
    return ", ".join(f"{scale * np.median([pair[which][key] for pair in pairs]):.2g}" for which in (0, 1))


def main() -> None:
    """Keep a line of every chain that was run again, and fill the page's second table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("runs/chain_ranges"))
    arguments = parser.parse_args()
    again = found_in(arguments.folder)
    text = "\n".join(json.dumps(found) for found in again.values())
    AGAIN.write_text(f"{text}\n", encoding="utf-8")
    recorded = {found["number"]: found for found in read_lines(RECORDED)}
    fill(PAGE, tables(recorded, again), "", BEGIN, END)


if __name__ == "__main__":
    main()
