"""Tracking timed: a thousand trackers in one call, and one step against Pinocchio; docs/benchmarks/tracking.md.

Run it from the repository's root: `make bench-tracking`, or `python -m experiments.benchmarks.tracking`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from experiments.benchmarks.machine import describe_machine
from experiments.benchmarks.tracking_tables import report
from experiments.pages import fill

TRACKERS, JACOBIANS, STEPS, DECOMPOSITIONS = (
    "trackers",
    "generalized Jacobian",
    "tracking step",
    "damped inverse",
)


def main() -> None:
    """Measure in a process on one core and in one on all, or take what was measured; then write the page's tables."""
    parser = argparse.ArgumentParser(
        prog="python -m experiments.benchmarks.tracking", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--out", default="docs/benchmarks/tracking.md", help="the page; rows go beside it")
    parser.add_argument("--quick", action="store_true", help="fewer trackers, states and samples")
    parser.add_argument("--redraw", action="store_true", help="only write the tables anew")
    parser.add_argument("--measure", choices=("one", "all"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.measure:
        for row in measured(arguments.measure == "all", arguments.quick):
            print(json.dumps(row), flush=True)
        return
    page = Path(arguments.out)
    rows_file = page.with_suffix(".jsonl")
    if not arguments.redraw:
        page.parent.mkdir(parents=True, exist_ok=True)
        with rows_file.open("w", encoding="utf-8") as file:
            for row in _everything(arguments.quick):
                file.write(json.dumps(row) + "\n")
                file.flush()
    rows = [json.loads(line) for line in rows_file.read_text(encoding="utf-8").splitlines()]
    text = report(rows)
    fill(page, text, "Tracking benchmark")
    print(text)


def _everything(quick: bool) -> Iterator[dict]:
    yield {"kind": "machine", "date": date.today().isoformat(), "quick": quick} | describe_machine()
    for cores in ("one", "all") if len(os.sched_getaffinity(0)) > 1 else ("one",):
        command = [sys.executable, "-m", "experiments.benchmarks.tracking", "--measure", cores]
        with subprocess.Popen(
            [*command, *(["--quick"] if quick else [])], stdout=subprocess.PIPE, text=True, encoding="utf-8"
        ) as process:
            for line in process.stdout:
                yield json.loads(line)
        if process.returncode:
            raise SystemExit(f"measuring on {cores} failed")


def measured(all_cores: bool, quick: bool) -> Iterator[dict]:
    """A row for each program: its time, once it agrees with the first of its kind."""
    import jax

    import jffsr

    if all_cores:
        threads = jffsr.use_all_cores()
    else:
        threads = 1
        # Affinity comes before JAX makes its threads.
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    jax.config.update("jax_enable_x64", True)
    from experiments.benchmarks.timing import timed
    from experiments.benchmarks.tracking_case import TrackingCase

    case = TrackingCase(64, 128) if quick else TrackingCase()
    yield {"kind": "load", "threads": threads, "load": os.getloadavg()[0]}
    for work, makers in _programs(case, threads).items():
        ready, first = {}, None
        for name, make in makers.items():
            row = {"kind": "measurement", "work": work, "program": name, "threads": threads}
            try:
                program = make()
                result = program.run()
            except ImportError as error:
                yield row | {"missing": " ".join(str(error).split())}
                continue
            first = result if first is None else first
            row["difference"] = _difference(result, first)
            ready[name] = (
                program,
                row
                | {
                    "done": program.batch or len(first),
                    "compile": program.compile_seconds,
                },
            )
        times = timed({name: program for name, (program, _) in ready.items()}, 3 if quick else 9)
        for name, timing in times.items():
            yield ready[name][1] | {
                "median": timing.median,
                "best": timing.best,
                "samples": len(timing.samples),
            }
    yield {"kind": "load", "threads": threads, "load": os.getloadavg()[0]}


def _programs(case, threads: int) -> dict[str, dict]:
    from experiments.benchmarks import tracking_work as ours
    from experiments.benchmarks.opponents import pinocchio_tracking as pinocchio

    found = {
        TRACKERS: {"jffsr": lambda: ours.trackers(case)},
        JACOBIANS: {
            "jffsr": lambda: ours.jacobians(case),
            "Pinocchio C++": lambda: pinocchio.jacobians(case, threads),
            "Pinocchio C++, shared": lambda: pinocchio.jacobians(case, threads, shared=True),
        },
        STEPS: {
            "jffsr": lambda: ours.steps(case),
            "Pinocchio C++": lambda: pinocchio.steps(case, threads),
        },
    }
    if threads == 1:
        # What is called one at a time from Python is not faster with more cores.
        found[TRACKERS]["jffsr, one at a time"] = lambda: ours.trackers_alone(case)
        found[JACOBIANS]["Pinocchio Python"] = lambda: pinocchio.python_jacobians(case)
        found[STEPS]["jffsr, one at a time"] = lambda: ours.steps_alone(case)
        found[STEPS]["Pinocchio Python"] = lambda: pinocchio.python_steps(case)
        found[DECOMPOSITIONS] = {
            "jffsr": lambda: ours.decompositions(case),
            "LAPACK": lambda: ours.decompositions_lapack(case),
        }
    return found


def _difference(result, first) -> float:
    """Largest difference over the rows that both have; SystemExit where it is not the same that was computed."""
    import numpy as np

    from experiments.benchmarks.tracking_case import TOLERANCE

    a, b = np.asarray(result), np.asarray(first)
    count = min(len(a), len(b))
    found = float(np.max(np.abs(a[:count] - b[:count])))
    if not found <= TOLERANCE:
        raise SystemExit(f"the programs do not agree: {found:.2e} apart, {TOLERANCE:g} allowed")
    return found


if __name__ == "__main__":
    main()
