"""One process: pinned to one core, or with all cores and a JAX device for each. Writes a JSON line a measurement."""

from __future__ import annotations

import json
import os
import sys
import time

# The two imports set nothing and start nothing: affinity and devices come first.
import jax

import jffsr
from experiments.benchmarks.ceiling import peak
from experiments.benchmarks.checking import agrees, difference
from experiments.benchmarks.jobs import REFERENCE, Job, jobs
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
    for job in jobs(all_cores, quick):
        measure(job, threads, quick)
    if jax.default_backend() == "cpu":
        write(kind="peak", threads=threads, operations_per_second=peak(threads))
        write(kind="operations", rollout=c_kernel.operations(REFERENCE))


def measure(job: Job, threads: int, quick: bool) -> None:
    """Check that all agree, time them in turn, write a line for each."""
    programs, rows, reference = {}, {}, None
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
            say(f"{job.work}: {name}: {reason(error)}")
            continue
        if reference is None:
            reference = result
        if job.work in (ROLLOUT, GRADIENT, TWIST):
            row["difference"] = difference(result, reference)
            row["agrees"] = agrees(row["difference"], job.case.precision, job.case.steps)
            if not row["agrees"]:
                write(**row, missing=f"not timed: differs by {row['difference']:.1e}")
                say(f"{job.work}, {label(job)}: {name} differs by {row['difference']:.1e}")
                continue
        row |= {"done": program.batch or job.case.batch, "compile": program.compile_seconds}
        programs[name], rows[name] = program, row
        say(f"{job.work}, {label(job)}: {name} ready after {time.perf_counter() - started:.1f} s")
    for name, timing in timed(programs, 3 if quick else 7).items():
        row = rows[name]
        write(**row, median=timing.median, best=timing.best, samples=len(timing.samples))
        say(f"{job.work}, {label(job)}: {name} {1e6 * timing.median / row['done']:.4g} us each")


def build(job: Job, name: str, threads: int) -> Program:
    """The opponent's program; ImportError where it is not installed."""
    opponent = OPPONENTS[name]
    if jax.default_backend() != "cpu" and not opponent.on_accelerators:
        raise Unsupported("runs on a CPU only")
    if job.work in PLANNING_WORK:
        return PLANNING_WORK[job.work][name](job.case)
    return opponent.program(job.work, job.case, threads)


def label(job: Job) -> str:
    """A case in a few words."""
    case = job.case
    return f"{case.robot_name}, {case.batch} x {case.steps}, {case.precision}"


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
