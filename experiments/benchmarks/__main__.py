"""Rollouts timed against everything else that computes them: the tables and the picture of docs/benchmarks.

Run it from the repository's root: `make bench`, or `python -m experiments.benchmarks`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from experiments.benchmarks.figure import draw
from experiments.benchmarks.machine import describe_machine
from experiments.benchmarks.tables import report
from experiments.pages import fill

MEMORY_ROLLOUTS = 65_536


def main() -> None:
    """Measure, or take what was measured, then write the tables into the page and draw the picture."""
    arguments = _arguments()
    page = Path(arguments.out)
    kept = page.with_suffix(".jsonl")
    if not arguments.redraw:
        page.parent.mkdir(parents=True, exist_ok=True)
        started = time.perf_counter()
        with kept.open("w", encoding="utf-8") as file:
            for row in _measured(arguments.quick):
                file.write(json.dumps(row) + "\n")
                file.flush()
        print(f"measured in {time.perf_counter() - started:.0f} s", file=sys.stderr)
    rows = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    text = report(rows)
    fill(page, text, "Rollouts")
    draw(rows, page.with_suffix(".png"))
    print(text)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m experiments.benchmarks", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--quick", action="store_true", help="fewer sizes and repetitions, for trying")
    parser.add_argument("--out", default="docs/benchmarks/rollouts.md")
    parser.add_argument("--redraw", action="store_true", help="from the measurements kept beside --out")
    return parser.parse_args()


def _measured(quick: bool) -> Iterator[dict]:
    yield {"kind": "machine", "date": date.today().isoformat(), "quick": quick} | describe_machine()
    extent = "quick" if quick else "full"
    yield from _process("worker", "one", extent)
    if len(os.sched_getaffinity(0)) > 1:
        yield from _process("worker", "all", extent)
    yield from _process("memory", str(MEMORY_ROLLOUTS if not quick else MEMORY_ROLLOUTS // 16))


def _process(module: str, *arguments: str) -> Iterator[dict]:
    """The JSON lines of a process of its own; its progress goes to our standard error."""
    command = [sys.executable, "-m", f"experiments.benchmarks.{module}", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, encoding="utf-8") as process:
        for line in process.stdout:
            yield json.loads(line)
    if process.returncode:
        raise SystemExit(f"{module} {' '.join(arguments)} failed")


if __name__ == "__main__":
    main()
