"""Compare the optimizers on robots: run what is missing, then write the page and its picture.

Run it from the root of the repository: `make compare`, or `python -m experiments.comparison`. Runs are kept one by one
in runs/ and, at the end, packed beside the page; the same command goes on where it was stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from experiments.comparison.page import draw, tables
from experiments.comparison.scenarios import SCENARIOS
from experiments.comparison.searches import SEARCHES
from experiments.comparison.work import pack, read_runs, run_missing, unpack
from experiments.pages import fill


def main() -> None:
    """Measure, or take what was measured, then write the tables into the page and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--budget", type=int, default=5000, help="evaluations charged to each search")
    parser.add_argument("--scenarios", default=",".join(s.name for s in SCENARIOS), help="names, by commas")
    parser.add_argument("--out", default="docs/benchmarks/optimizers_on_robots.md")
    parser.add_argument("--redraw", action="store_true", help="from the runs kept beside --out alone")
    arguments = parser.parse_args()
    page = Path(arguments.out)
    kept, packed = Path("runs/benchmarks") / f"{page.stem}.jsonl", page.with_suffix(".jsonl.gz")
    unpack(packed, kept)
    if not arguments.redraw:
        page.parent.mkdir(parents=True, exist_ok=True)
        kept.parent.mkdir(parents=True, exist_ok=True)
        chosen = [s for s in SCENARIOS if s.name in arguments.scenarios.split(",")]
        run_missing(kept, chosen, SEARCHES, range(arguments.seeds), arguments.budget)
        pack(kept, packed)
    runs, facts = read_runs(kept)
    fill(page, tables(runs, facts), "Optimizers on robots")
    draw(page.with_suffix(".png"), runs, SEARCHES)


if __name__ == "__main__":
    main()
