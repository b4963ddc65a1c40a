"""What an opponent hands over: something to run, and how long it took to compile."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from experiments.benchmarks.cases import FLOAT64
from experiments.benchmarks.precision import precision


class Unsupported(Exception):
    """An opponent that is installed but has no such path; the sentence says why."""


@dataclass(frozen=True)
class Program:
    """run() does the whole work and returns when it is done; batch is that of the case unless it says another.

    A smaller batch is for what would take too long: its time is given per rollout, and marked.
    """

    run: Callable[[], Any]
    compile_seconds: float
    batch: int | None = None


def compiled(
    function: Callable, *arguments, batch: int | None = None, precision_name: str = FLOAT64
) -> Program:
    """A JAX function lowered and compiled for these arguments, which are put on the device first."""
    import jax

    from jffsr.compiling import jit

    with precision(precision_name):
        placed = jax.block_until_ready(jax.device_put(arguments))
        started = time.perf_counter()
        program = jit(function).lower(*placed).compile()
        seconds = time.perf_counter() - started

    def run():
        with precision(precision_name):
            return jax.block_until_ready(program(*placed))

    return Program(run, seconds, batch)


def called(
    function: Callable, *arguments, batch: int | None = None, precision_name: str = FLOAT64
) -> Program:
    """A function that compiles by itself when it is first called: the first call less the second is compiling."""
    import jax

    with precision(precision_name):
        placed = jax.block_until_ready(jax.device_put(arguments))

    def run():
        with precision(precision_name):
            return jax.block_until_ready(function(*placed))

    seconds = []
    for _ in range(2):
        started = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - started)
    return Program(run, max(0.0, seconds[0] - seconds[1]), batch)
