"""Compiling the programs of a run before it comes to them."""

from __future__ import annotations

from concurrent.futures import Future

import jax

from jffsr.optimizers import driver
from jffsr.optimizers.driver import Phase, Snapshot
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.parallel.devices import all_devices
from jffsr.types import Array


@jax.jit
def _population(optimizer, state):
    return optimizer.population(state)


def prepare_run(
    phases: list[Phase],
    problem: OptimizationProblem,
    key: Array,
    *,
    chunk: int = 10,
    resume: Snapshot | None = None,
) -> list[Future]:
    """Begin to compile, in threads, what `driver.run` with these arguments will call after its first program.

    The futures may be cancelled where the run ends early.
    """
    with all_devices():
        return _prepared(phases, problem, key, chunk, resume)


def _prepared(
    phases: list[Phase], problem: OptimizationProblem, key: Array, chunk: int, resume: Snapshot | None
) -> list[Future]:
    first = resume.phase if resume else 0
    population, prepared = None, []
    for index in range(first, len(phases)):
        optimizer, stop = phases[index].optimizer, phases[index].stop
        start = (optimizer, problem, jax.random.fold_in(key, index), population)
        state = resume.state if resume and index == first else driver._init.shape(*start)
        prepared.append(driver._advance_jit.prepare(optimizer, problem, state, stop, chunk))
        if index > first:
            prepared.append(driver._init.prepare(*start))
        population = _population.eval_shape(optimizer, state)
    return [future for future in prepared if future is not None]
