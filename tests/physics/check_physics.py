"""The physics of random robots as a table: `make check-physics`. Exit 1 where a law is broken."""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import jax
import numpy as np
from tqdm import tqdm

SEED = 20260


def run_batch(number: int, count: int, num_steps: int) -> tuple[list[str], dict[str, np.ndarray]]:
    """Joint types and the errors of one batch; in a process of its own, so that it sets its own precision."""
    jax.config.update("jax_enable_x64", True)
    from laws import batch_of, check

    # Each topology is another program, and none comes back.
    jax.clear_caches()
    batch = batch_of(SEED, number, count)
    return list(batch.robots[0].topology.joint_types), check(batch, num_steps)


def main() -> int:
    """Run all batches, print the table, and judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--topologies", type=int, default=100)
    parser.add_argument("--robots", type=int, default=10, help="robots of each topology")
    parser.add_argument("--steps", type=int, default=20000, help="Runge-Kutta steps of the 10 s of coasting")
    parser.add_argument("--jobs", type=int, default=2)
    wanted = parser.parse_args()
    from laws import TOLERANCE

    errors, kinds = defaultdict(list), defaultdict(int)
    with ProcessPoolExecutor(wanted.jobs, mp_context=get_context("spawn")) as pool:
        runs = [
            pool.submit(run_batch, number, wanted.robots, wanted.steps) for number in range(wanted.topologies)
        ]
        for run in tqdm(runs, ncols=80, unit="topology"):
            joints, found = run.result()
            for joint in joints:
                kinds[joint] += wanted.robots
            for law, values in found.items():
                errors[law].append(values)

    robots = wanted.topologies * wanted.robots
    joints = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    print(f"{robots} robots of {wanted.topologies} topologies, {joints} joints; relative errors\n")
    print(f"{'law':<42}{'median':>10}{'worst':>10}{'allowed':>10}")
    broken = 0
    for law, parts in errors.items():
        values = np.concatenate(parts)
        # Written so that a NaN breaks the law.
        kept = bool(np.all(values <= TOLERANCE)) and len(values) == robots
        broken += not kept
        worst = np.max(values)
        print(
            f"{law:<42}{np.median(values):>10.1e}{worst:>10.1e}{TOLERANCE:>10.0e}{'' if kept else '  BROKEN'}"
        )
    print(f"\n{'every law holds' if not broken else f'{broken} laws are broken'}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
