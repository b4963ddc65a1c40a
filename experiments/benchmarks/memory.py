"""Peak memory of many rollouts with their gradients, in a process of its own."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import jax
import numpy as np

import jffsr
from experiments.benchmarks.jobs import REFERENCE
from experiments.benchmarks.planning_work import problem_of


def main() -> None:
    """Argument: the number of rollouts. Writes a JSON line."""
    count = int(sys.argv[1])
    cores = jffsr.use_all_cores()
    jax.config.update("jax_enable_x64", True)
    problem = problem_of(REFERENCE)
    lower, upper = (np.asarray(bound) for bound in problem.bounds())
    batch = np.random.default_rng(0).uniform(0.3 * lower, 0.3 * upper, (count, lower.size))
    gradient = jax.value_and_grad(problem.smooth_and_value, has_aux=True)
    result = jax.block_until_ready(jffsr.map_batch(gradient, batch))
    finite = bool(all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree.leaves(result)))
    row = {"kind": "memory", "rollouts": count, "steps": REFERENCE.steps, "devices": cores}
    print(json.dumps(row | {"finite": finite, "peak_bytes": peak_bytes()}), flush=True)


def peak_bytes() -> int:
    """Largest resident size of this process so far.

    Not of `getrusage`: that number begins with the size of the process that started this one.
    """
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    line = next(line for line in lines if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024


if __name__ == "__main__":
    main()
