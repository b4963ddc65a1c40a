"""One process: pinned to one core, or with all cores and a JAX device for each. Writes a JSON line a measurement."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Iterator

# The two imports set nothing and start nothing: affinity and devices come first.
import jax

import jffsr
from experiments.benchmarks.ceiling import peak
from experiments.benchmarks.checking import agrees, difference
from experiments.benchmarks.jobs import REFERENCE, Job, groups
from experiments.benchmarks.machine import describe_device
from experiments.benchmarks.opponents import c_kernel
from experiments.benchmarks.opponents.program import Program, Unsupported
from experiments.benchmarks.opponents.registry import GRADIENT, OPPONENTS, ROLLOUT, TWIST
from experiments.benchmarks.planning_work import PLANNING_WORK
from experiments.benchmarks.timing import timed


def main() -> None:
    """Arguments: `one` or `all` (cores), `full` or `quick`."""
    all_cores, quick = sys.argv[1] == "all", sys.argv[2] == "quick"
    allowed = sorted(os.sched_getaffinity(0))
    if all_cores:
        threads = jffsr.use_all_cores()
    else:
        threads = 1
        os.sched_setaffinity(0, allowed[:1])
    jax.config.update("jax_enable_x64", True)
    write(kind="device", cores="all" if all_cores else "one", threads=threads, **describe_device())
    for group in groups(all_cores, quick):
        measure(group, threads, quick)
    if jax.default_backend() == "cpu":
        write(kind="peak", threads=threads, operations_per_second=peak(threads))
        write(kind="operations", rollout=c_kernel.operations(REFERENCE))


def measure(group: list[Job], threads: int, quick: bool) -> None:
    """Check that all of a job agree, time the group in turn, write a line for each."""
    ready = [pair for job in group for pair in prepared(job, threads)]
    programs = {str(place): program for place, (program, _) in enumerate(ready)}
    for (_, row), timing in zip(ready, timed(programs, 3 if quick else 7).values(), strict=True):
        write(**row, median=timing.median, best=timing.best, samples=len(timing.samples))
        say(f"{label(row)}: {row['opponent']} {1e6 * timing.median / row['done']:.4g} us each")


def prepared(job: Job, threads: int) -> Iterator[tuple[Program, dict]]:
    """The programs of a job that agree with the first, and what is known of each; the others are written down."""
    reference = None
    for name in job.opponents:
        row = {
            "kind": "measurement", "work": job.work, "axis": job.axis, "opponent": name, "threads": threads,
            "robot": job.case.robot_name, "batch": job.case.batch, "steps": job.case.steps,
            "precision": job.case.precision,
        }  # fmt: skip
        started = time.perf_counter()
        try:
            program = build(job, name, threads)
            result = program.run()
        except Exception as error:  # whatever another library's version does, the others are still measured
            if OPPONENTS[name].own:
                raise
            write(**row, missing=reason(error))
            say(f"{label(row)}: {name}: {reason(error)}")
            continue
        if reference is None:
            reference = result
        if job.work in (ROLLOUT, GRADIENT, TWIST):
            row["difference"] = difference(result, reference)
            row["agrees"] = agrees(row["difference"], job.case.precision, job.case.steps)
            if not row["agrees"]:
                write(**row, missing=f"not timed: differs by {row['difference']:.1e}")
                say(f"{label(row)}: {name} differs by {row['difference']:.1e}")
                continue
        row |= {"done": program.batch or job.case.batch, "compile": program.compile_seconds}
        say(f"{label(row)}: {name} ready after {time.perf_counter() - started:.1f} s")
        yield program, row


def build(job: Job, name: str, threads: int) -> Program:
    """The opponent's program; ImportError where it is not installed."""
    opponent = OPPONENTS[name]
    if jax.default_backend() != "cpu" and not opponent.on_accelerators:
        raise Unsupported("runs on a CPU only")
    if job.work in PLANNING_WORK:
        return PLANNING_WORK[job.work][name](job.case)
    return opponent.program(job.work, job.case, threads)


def label(row: dict) -> str:
    """Work and case in a few words."""
    return f"{row['work']}, {row['robot']}, {row['batch']} x {row['steps']}, {row['precision']}"


def reason(error: Exception) -> str:
    """Why an opponent is missing, in one line."""
    text = " ".join(str(error).split())
    if isinstance(error, Unsupported):
        return text
    if isinstance(error, ImportError):
        return f"not installed: {text}"
    return f"failed: {type(error).__name__}: {text[:200]}"


def say(text: str) -> None:
    """Progress, to standard error."""
    print(text, file=sys.stderr, flush=True)


def write(**row) -> None:
    """One JSON line."""
    print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
