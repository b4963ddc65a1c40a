"""The one loop: any optimizer, in compiled chunks, with progress, stopping and checkpoints on the host.

A run is a list of phases, each an optimizer with its own stopping rule; a phase starts from the population
that the one before left (hybrid: a swarm, then gradients). Between chunks the host reports, saves and looks
for an interrupt. Chunks only group steps: their size does not change the result. Populations are evaluated on all
devices of the mesh in use, else on all there are; everything else is the same on each of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np

from jffsr.compiling import Program, program
from jffsr.errors import InputError
from jffsr.optimizers import history as history_of
from jffsr.optimizers.history import Record
from jffsr.optimizers.interface import OptimizationProblem, Optimizer, Population, Progress
from jffsr.parallel.devices import all_devices, on_all_devices
from jffsr.pytrees import register_dataclass
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class Stop:
    """When a phase ends: counts of its own iterations, objective and gradient evaluations, or a value."""

    iterations: Array | float = np.inf
    evaluations: Array | float = np.inf
    gradient_evaluations: Array | float = np.inf
    target: Array | float = -np.inf

    def reached(self, progress: Progress) -> Array:
        """Whether the phase is over."""
        return (
            progress.converged
            | (progress.iteration >= self.iterations)
            | (progress.evaluations >= self.evaluations)
            | (progress.gradient_evaluations >= self.gradient_evaluations)
            | (progress.best_value <= self.target)
        )


@dataclass(frozen=True)
class Phase:
    """An optimizer, its name in reports, and when it ends."""

    name: str
    optimizer: Optimizer
    stop: Stop = field(default_factory=Stop)


@dataclass(frozen=True)
class Snapshot:
    """Everything a run needs to go on: the phase, its state, and the history so far (thinned where it is long)."""

    phase: int
    state: Any
    history: tuple[Record, ...]


@dataclass(frozen=True)
class Outcome:
    """What a run found. `reason` is converged, budget, target or interrupted.

    violation is of the best point's constraints, where `jffsr.minimize` was given some.
    """

    best_position: np.ndarray
    best_value: float
    evaluations: int
    gradient_evaluations: int
    history: tuple[Record, ...]
    reason: str
    population: Population
    violation: float = 0.0

    @property
    def interrupted(self) -> bool:
        """Whether the run was stopped before its end."""
        return self.reason == "interrupted"


@program()
def _init(optimizer, problem, key, population):
    # A step gives back strongly typed numbers: a weakly typed start would compile the first chunk on its own.
    return jax.tree.map(_strongly_typed, optimizer.init(key, problem, population))


def _strongly_typed(x: Array) -> Array:
    is_key = jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key)
    return x if is_key else jax.lax.convert_element_type(x, x.dtype)


def _advance(optimizer, problem, state, stop, length):
    # A loop of one turn would be compiled as no loop, and round otherwise: it gets a second, idle one.
    idle = np.arange(max(length, 2)) >= length

    def one(state, idle):
        state = jax.lax.cond(
            stop.reached(state.progress) | idle, lambda s: s, lambda s: optimizer.step(problem, s), state
        )
        p = state.progress
        return state, (p.iteration, p.evaluations, p.gradient_evaluations, p.best_value)

    return jax.lax.scan(one, state, idle)


_advance_jit = Program(_advance, static_argnums=4)


def run(
    phases: list[Phase],
    problem: OptimizationProblem,
    key: Array,
    *,
    chunk: int = 10,
    population: Population | None = None,
    resume: Snapshot | None = None,
    on_chunk: Callable[[Snapshot], None] | None = None,
    interrupted: Callable[[], bool] = lambda: False,
) -> Outcome:
    """Run the phases one after another and return the best point found.

    `on_chunk` sees a snapshot after every chunk, from which `resume` goes on to the same bits.
    `interrupted` is asked between chunks.
    """
    if not phases:
        raise InputError("there is no phase to run")
    history: list[Record] = list(resume.history) if resume else []
    first = resume.phase if resume else 0
    with all_devices():
        # As a chunk gives it back, so that the first chunk is not compiled on its own.
        state = on_all_devices(resume.state) if resume else None
    for index in range(first, len(phases)):
        phase = phases[index]
        before = _evaluations_before(history, index)
        if state is None:
            with all_devices():
                state = _init(phase.optimizer, problem, jax.random.fold_in(key, index), population)
        while not phase.stop.reached(jax.device_get(state.progress)):
            if interrupted():
                return _outcome(phase, state, history, "interrupted")
            last = int(state.progress.iteration)
            with all_devices():
                state, rows = _advance_jit(phase.optimizer, problem, state, phase.stop, chunk)
            for row in zip(*jax.device_get(rows), strict=True):
                if row[0] > last:
                    last = row[0]
                    history_of.add(history, _record(index, before, *row))
            _tell(on_chunk, index, state, history)
        best = float(state.progress.best_value)
        reason = _reason(phase.stop, state.progress, best)
        if reason == "target" or index == len(phases) - 1:
            return _outcome(phase, state, history, reason)
        population, state = phase.optimizer.population(state), None
    raise AssertionError("unreachable")


def _reason(stop: Stop, progress: Progress, best: float) -> str:
    if best <= float(stop.target):
        return "target"
    return "converged" if bool(progress.converged) else "budget"


def _tell(on_chunk, index, state, history) -> None:
    if on_chunk is not None:
        on_chunk(Snapshot(index, state, tuple(history)))


def _evaluations_before(history: list[Record], phase: int) -> tuple[int, int]:
    earlier = [record for record in history if record.phase < phase]
    return (earlier[-1].evaluations, earlier[-1].gradient_evaluations) if earlier else (0, 0)


def _record(phase, before, iteration, evaluations, gradient_evaluations, best) -> Record:
    return Record(
        phase,
        int(iteration),
        before[0] + int(evaluations),
        before[1] + int(gradient_evaluations),
        float(best),
    )


def _outcome(phase: Phase, state, history: list[Record], reason: str) -> Outcome:
    progress = jax.device_get(state.progress)
    return Outcome(
        best_position=np.asarray(progress.best_position),
        best_value=float(progress.best_value),
        evaluations=history[-1].evaluations if history else 0,
        gradient_evaluations=history[-1].gradient_evaluations if history else 0,
        history=tuple(history),
        reason=reason,
        population=jax.device_get(phase.optimizer.population(state)),
    )


def blank_state(phases: list[Phase], index: int, problem: OptimizationProblem, key: Array):
    """Shapes of the state of a phase, without computing it: what a checkpoint is read into."""
    population = None
    for number, phase in enumerate(phases[: index + 1]):
        shape = jax.eval_shape(
            lambda o, p, k, pop: o.init(k, p, pop),
            phase.optimizer,
            problem,
            jax.random.fold_in(key, number),
            population,
        )
        if number < index:
            population = jax.eval_shape(phase.optimizer.population, shape)
    return shape


__all__ = ["Outcome", "Phase", "Record", "Snapshot", "Stop", "blank_state", "run"]
