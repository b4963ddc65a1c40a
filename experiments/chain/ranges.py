"""Recorded chains run again with the joints' ranges in the reference, beside what became of them without.

`python -m experiments.chain --seeds 16,23 --folder runs/chain_ranges` runs some of them again, and
`python -m experiments.chain.ranges --folder runs/chain_ranges` puts what is found there into the page. Of those in
which a joint had left its range the hold is also made again without the ranges, from the same grasp.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import jax
import numpy as np

from experiments.captures.work import read_lines
from experiments.chain.page import line
from experiments.pages import fill
from jffsr.compiling.keeping import keep_programs
from jffsr.study.chain.carried_out import hold_of
from jffsr.study.chain.outcome import ChainCode
from jffsr.study.chain.reviewing import grasp_of
from jffsr.study.chain.running import HOLD
from jffsr.study.dataset import open_dataset
from jffsr.tracking.redundancy import range_share

BEGIN, END = "<!-- with ranges: begin -->", "<!-- with ranges: end -->"
PAGE = Path("docs/benchmarks/chain.md")
RECORDED, AGAIN = PAGE.with_suffix(".jsonl"), PAGE.with_name("chain_ranges.jsonl")
_GROUPS = ((ChainCode.NOT_HELD, "a joint left its range"), (ChainCode.HELD, "grasped and held"))
_COUNTS = (
    "without the ranges",
    "of these run again",
    "with them held",
    "a joint left its range",
    "ended otherwise",
    "base rate at the end, mrad/s, median without, with",
    "base turned by, deg, median without, with",
)
_USED = (
    "chain",
    "momentum, N m s",
    "at the grasp",
    "most, without",
    "most, with",
    "most, if joints only braked",
    "at the end, without",
    "at the end, with",
)


def found_in(folder: Path) -> dict[int, dict]:
    """A line of every finished chain in a folder, by its number."""
    lines = {}
    for file in sorted(folder.glob("[0-9]*/summary.json")):
        summary, number = json.loads(file.read_text(encoding="utf-8")), int(file.parent.name)
        lines[number] = {"number": number} | line(summary)
    return lines


def used_in(folder: Path) -> dict[str, list[float] | float]:
    """How much of its range the joint that is nearest to an end uses: 1 is the end.

    with, without: at the grasp, at most, and when the hold ends, as it was run, and without the ranges from the same
    grasp; braked: at least, if each joint brakes from the grasp on at its acceleration limit.
    """
    run, study, compound, known = grasp_of(folder)
    config, limits, hold = run.read_config(), study.robot.limits, open_dataset(folder / HOLD)
    free = config.model_copy(update={"hold": config.hold.model_copy(update={"ranges": None})})
    ways = {
        "with": hold["joint_position"].to_numpy(),
        "without": hold_of(free, study, compound, known).run.states.joint_position,
    }
    used: dict[str, list[float] | float] = {}
    for name, way in ways.items():
        most = np.abs(np.asarray(range_share(limits, way)[0])).max(axis=1)
        used[name] = [float(x) for x in (most[0], most.max(), most[-1])]
    begin, rate = ways["with"][0], hold["joint_velocity"].to_numpy()[0]
    stop = begin + rate * np.abs(rate) / (2 * np.asarray(limits.acceleration))
    shares = [np.abs(np.asarray(range_share(limits, place)[0])) for place in (begin, stop)]
    used["braked"] = float(np.max(shares))
    return used


def tables(recorded: dict[int, dict], again: dict[int, dict]) -> str:
    """What became of those that were run again, by what had become of them; then how much of its range the joint
    nearest to an end used, where that is known."""
    rows = _table(_COUNTS)
    for code, words in _GROUPS:
        before = [old for old in recorded.values() if old["code"] == code]
        pairs = [(old, again[old["number"]]) for old in before if old["number"] in again]
        codes = [new["code"] for _, new in pairs]
        held, left = codes.count(ChainCode.HELD), codes.count(ChainCode.NOT_HELD)
        both = [(old, new) for old, new in pairs if "base_rate" in new]
        counts = f"{words}: {len(before)} | {len(pairs)} | {held} | {left} | {len(codes) - held - left}"
        medians = f"{_medians(both, 'base_rate', 1e3)} | {_medians(both, 'turned', np.rad2deg(1.0))}"
        rows.append(f"| {counts} | {medians} |")
    rows += [
        "",
        "Share of the way from the middle of a range to its end that was used, the most of any joint:",
        "",
    ]
    rows += _table(_USED)
    for number, found in again.items():
        if "used" in found:
            start, most, end = found["used"]["with"]
            braked = found["used"]["braked"]
            _, free_most, free_end = found["used"]["without"]
            shares = " | ".join(f"{share:.5f}" for share in (start, free_most, most, braked, free_end, end))
            rows.append(f"| {number} | {found['momentum']:.2f} | {shares} |")
    return "\n".join(rows)


def _table(heads: tuple[str, ...]) -> list[str]:
    return [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]


def _medians(pairs: list[tuple[dict, dict]], key: str, scale: float) -> str:
    if not pairs:
        return ""
    return ", ".join(f"{scale * np.median([pair[which][key] for pair in pairs]):.2g}" for which in (0, 1))


def main() -> None:
    """Keep a line of every chain that was run again, and fill the page's second part."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("runs/chain_ranges"))
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    keep_programs()
    recorded = {found["number"]: found for found in read_lines(RECORDED)}
    again = found_in(arguments.folder)
    for number, found in again.items():
        if recorded[number]["code"] == ChainCode.NOT_HELD and "base_rate" in found:
            found["used"] = used_in(arguments.folder / f"{number:04d}")
            print(number, found["used"], flush=True)
    AGAIN.write_text("".join(json.dumps(found) + "\n" for found in again.values()), encoding="utf-8")
    fill(PAGE, tables(recorded, again), "", BEGIN, END)


if __name__ == "__main__":
    main()
