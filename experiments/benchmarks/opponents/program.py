"""What an opponent hands over: something to run, and how long it took to compile."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


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


def compiled(function: Callable, *arguments, batch: int | None = None) -> Program:
    """A JAX function lowered and compiled for these arguments, which are put on the device first."""
    import jax

    from jffsr.compiling import jit

    placed = jax.block_until_ready(jax.device_put(arguments))
    started = time.perf_counter()
    program = jit(function).lower(*placed).compile()
    seconds = time.perf_counter() - started
    return Program(lambda: jax.block_until_ready(program(*placed)), seconds, batch)
