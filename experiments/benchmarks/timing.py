"""Programs timed side by side: in turn, so that a load on the machine meets all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

from experiments.benchmarks.opponents.program import Program

SHORTEST = 0.02
"""A sample is no shorter than this, s: short programs are called several times for one."""


@dataclass(frozen=True)
class Timing:
    """Seconds of one call: all samples, and their median and best."""

    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """The middle one."""
        return median(self.samples)

    @property
    def best(self) -> float:
        """The least."""
        return min(self.samples)


def timed(
    programs: Mapping[str, Program],
    repetitions: int = 7,
    patience: float = 3.0,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[str, Timing]:
    """Every program's time, after one call that is not counted.

    A program that has used `patience` seconds is not repeated further, once it has three samples.
    """
    numbers, samples = {}, {name: [] for name in programs}
    for name, program in programs.items():
        program.run()
        numbers[name] = max(1, int(SHORTEST / max(_seconds(program, 1, clock), 1e-7)))
    for _ in range(repetitions):
        for name, program in programs.items():
            taken = samples[name]
            if len(taken) >= 3 and sum(taken) * numbers[name] > patience:
                continue
            taken.append(_seconds(program, numbers[name], clock))
    return {name: Timing(tuple(taken)) for name, taken in samples.items()}


def _seconds(program: Program, number: int, clock: Callable[[], float]) -> float:
    started = clock()
    for _ in range(number):
        program.run()
    return (clock() - started) / number
