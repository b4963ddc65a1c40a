"""Many problems of one shape planned by one compiled program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.planning.fingerprint import fingerprint
from jffsr.planning.plan import check_precision
from jffsr.planning.plans_file import load_plans, save_plans
from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances, result_code, settled
from jffsr.planning.search import search_of, searchable
from jffsr.planning.verification import Verification, verify
from jffsr.robots.stacking import first_unlike
from jffsr.rollouts.motion import Motion
from jffsr.types import Array

CHUNK_BETWEEN_CHECKPOINTS = 64


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plans:
    """A batch of verified plans on the host, leading axis (K,) on every array.

    result, int32, the code of `ResultCode`; cost, the published index; free (K, k); evaluations and
    gradient_evaluations counted apart.
    """

    result: Array
    cost: Array
    free: Array
    motion: Motion
    verification: Verification
    evaluations: Array
    gradient_evaluations: Array


def plan_many(
    problems: Sequence[Problem],
    optimizer: str = "hybrid",
    settings: Settings | None = None,
    *,
    seed: int = 0,
    step_factor: int = 4,
    tolerances: Tolerances | None = None,
    chunk: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Plans:
    """Plan problems that differ only in numbers (robots of one topology, tasks, limits, momenta) at once.

    The search, the re-run and the verdict of all of them are one compiled program, spread over all devices of the mesh
    in use, else over all. Every problem uses its whole budget, unless it reaches the settings' target, from where its
    state stands still. `chunk` plans are made at a time (all; 64 with a checkpoint), and memory grows with it; after
    each chunk the plans so far are written to the file `checkpoint`, from which the same call goes on where it was
    killed. Raises InputError where the problems are of different structure or shape, and where the file is of others.
    """
    problems = list(problems)
    if not problems:
        raise InputError("plan_many was given no problem")
    if chunk is not None and chunk < 1:
        raise InputError(f"chunk is {chunk}; a positive number of plans is expected")
    other = first_unlike(problems)
    if other is not None:
        raise InputError(
            f"problem {other} differs from problem 0 in more than numbers (its robot's topology or names, its "
            f"terms, num_steps, or the shape of an array); plan it apart"
        )
    check_precision("float64")
    stacked = jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *problems)
    settings, tolerances = settings or Settings(), tolerances or Tolerances()
    phases, _ = search_of(problems[0], optimizer, settings)
    lengths = tuple(int(phase.stop.iterations) for phase in phases)
    optimizers = [(phase.optimizer, phase.stop) for phase in phases]
    count = len(problems)
    chunk = min(chunk or (count if checkpoint is None else CHUNK_BETWEEN_CHECKPOINTS), count)

    def part(start: int) -> tuple:
        """The arguments for the plans from `start` on; behind the last problem it is repeated."""
        numbers = np.minimum(np.arange(start, start + chunk), count - 1)
        piece = jax.tree.map(lambda leaf: leaf[numbers], stacked)
        return piece, optimizers, seed, numbers, lengths, step_factor, tolerances

    parts, done = [], 0
    if checkpoint is not None:
        checkpoint = Path(checkpoint)
        mark = fingerprint(problems[0], stacked, optimizer, settings, seed, step_factor, tolerances)
        earlier = load_plans(checkpoint, mark, _plan_chunk.eval_shape(*part(0)))
        if earlier is not None:
            parts, done = [earlier], len(earlier.cost)
    while done < count:
        with all_devices():
            found = jax.device_get(_plan_chunk(*part(done)))
        parts.append(jax.tree.map(lambda leaf, left=count - done: leaf[:left], found))
        done += chunk
        if checkpoint is not None:
            parts = [_joined(parts)]
            save_plans(checkpoint, mark, parts[0])
    return _joined(parts)


def _joined(parts: list[Plans]) -> Plans:
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


@partial(jit, static_argnums=(4, 5, 6))
def _plan_chunk(problems, optimizers, seed, numbers, lengths, step_factor, tolerances):
    def one(numbered: tuple[Problem, Array]) -> Plans:
        problem, number = numbered
        searched = searchable(problem)
        key = jax.random.fold_in(jax.random.key(seed), number)
        population, evaluations, gradients, best = None, 0, 0, []
        for index, ((optimizer, stop), length) in enumerate(zip(optimizers, lengths, strict=True)):
            state = optimizer.init(jax.random.fold_in(key, index), searched, population)

            def step(state, _, optimizer=optimizer, stop=stop):
                done = stop.reached(state.progress)
                following = optimizer.step(searched, state)
                state = jax.tree.map(lambda old, new: jnp.where(done, old, new), state, following)
                return state, state.progress.best_value

            state, values = jax.lax.scan(step, state, length=length)
            best.append(values)
            evaluations += state.progress.evaluations
            gradients += state.progress.gradient_evaluations
            population = optimizer.population(state)
        free = state.progress.best_position
        motion, verification = verify(problem, free, step_factor)
        ended = state.progress.converged | settled(jnp.concatenate(best))
        return Plans(
            result=result_code(problem, verification, ended, tolerances),
            cost=problem.objective.value(problem.robot, motion)
            if problem.constraints
            else state.progress.best_value,
            free=free,
            motion=motion,
            verification=verification,
            evaluations=jnp.asarray(evaluations),
            gradient_evaluations=jnp.asarray(gradients),
        )

    return spread(one, (problems, numbers), together=True)
