"""Plan a thousand random captures, and write what came of them into the page.

Run it from the root of the repository: `make captures`, or `python -m experiments.captures`. What was planned is kept
line by line in runs/captures, and the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import jax

from experiments.captures.page import CaptureSet, draw, tables
from experiments.captures.sampling import read_seed
from experiments.captures.work import AGAIN, SETTINGS, feasible, is_captured, planned, read_lines, sampled
from experiments.pages import fill
from jffsr.compiling.keeping import keep_programs
from jffsr.dynamics.base_mode import ATTITUDE_HELD, FLOATING

SETS = (("first", FLOATING), ("second", FLOATING), ("first", ATTITUDE_HELD))
"""Two sets of samples, and the first once more with the base's attitude held, as the anchor has it."""
AGAIN_PART = 16
LEAST_SHARE = 0.95
"""Captured in each set, below which `--check` fails."""


def main() -> None:
    """Sample, plan, plan again what failed, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="feasible captures of each set")
    parser.add_argument("--part", type=int, default=64, help="captures planned at once")
    parser.add_argument("--sets", default="0,1,2", help="which sets, by commas")
    parser.add_argument("--folder", default="runs/captures")
    parser.add_argument("--out", default="docs/benchmarks/captures.md")
    parser.add_argument("--redraw", action="store_true", help="from the lines kept in --folder alone")
    parser.add_argument(
        "--check", action="store_true", help="write no page; fail where fewer than 95 % are captured"
    )
    arguments = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    keep_programs()
    folder = Path(arguments.folder)
    found = []
    for name, mode in (SETS[int(number)] for number in arguments.sets.split(",")):
        samples, first, again = (
            folder / f"{name}{part}.jsonl" for part in ("_samples", f"_{mode}", f"_{mode}_again")
        )
        if not arguments.redraw:
            numbers = feasible(sampled(samples, read_seed(name), arguments.count), arguments.count)
            lines = planned(first, read_seed(name), numbers, arguments.part, mode, SETTINGS)
            failed = [line["number"] for line in lines if not is_captured(line)]
            planned(again, read_seed(name), failed, AGAIN_PART, mode, AGAIN)
        found.append(CaptureSet(name, mode, *map(read_lines, (samples, first, again))))
    if arguments.check:
        print(tables(found))
        raise SystemExit(any(one.share < LEAST_SHARE for one in found))
    page = Path(arguments.out)
    page.parent.mkdir(parents=True, exist_ok=True)
    fill(page, tables(found), "A thousand captures")
    draw(page.with_suffix(".png"), found)


if __name__ == "__main__":
    main()
