"""Many problems of one shape planned by one compiled program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

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
from jffsr.planning.search import found_index, search_of, searchable
from jffsr.planning.verification import Verification, verify
from jffsr.pytrees import register_dataclass
from jffsr.robots.stacking import first_unlike
from jffsr.rollouts.motion import Motion
from jffsr.types import Array

CHUNK_BETWEEN_CHECKPOINTS = 64


@register_dataclass
@dataclass(frozen=True)
class PlanHistory:
    """Best value so far after every step, and what was spent until then, (K, steps) each."""

    best_value: Array
    evaluations: Array
    gradient_evaluations: Array


@register_dataclass
@dataclass(frozen=True)
class Plans:
    """A batch of verified plans on the host, leading axis (K,) on every array.

    result, int32, the code of `ResultCode`; cost, the published index; free (K, k); evaluations and
    gradient_evaluations counted apart; history, the search step by step where it was asked for.
    """

    result: Array
    cost: Array
    free: Array
    motion: Motion
    verification: Verification
    evaluations: Array
    gradient_evaluations: Array
    history: PlanHistory | None = None


def plan_many(
    problems: Sequence[Problem],
    optimizer: str = "hybrid",
    settings: Settings | Sequence[Settings] | None = None,
    *,
    seed: int = 0,
    seeds: Sequence[int] | None = None,
    step_factor: int = 4,
    tolerances: Tolerances | None = None,
    chunk: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    with_history: bool = False,
) -> Plans:
    """Plan problems that differ only in numbers (robots of one topology, tasks, limits, momenta) at once.

    The search, the re-run and the verdict of all of them are one compiled program, spread over all devices of the mesh
    in use, else over all. Every problem uses its whole budget, unless it reaches the settings' target, from where its
    state stands still. Each problem may have its own settings, where these differ only in numbers that neither shape
    arrays nor count steps; and its own of `seeds`, from which it is drawn as `solve` draws from its seed, wherever it
    stands in the list (without them, from `seed` and its place). `chunk` plans are made at a time (all; 64 with a
    checkpoint), and memory grows with it; after each chunk the plans so far are written to the file `checkpoint`, from
    which the same call goes on where it was killed. Raises InputError where the problems or settings are of different
    structure or shape, and where the file is of others.
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
    tolerances = tolerances or Tolerances()
    alike, each, lengths = _optimizers(problems[0], optimizer, settings or Settings(), len(problems))
    count = len(problems)
    if seeds is not None and len(seeds) != count:
        raise InputError(f"{len(seeds)} seeds were given for {count} problems; one for each is expected")
    draws = np.arange(count) if seeds is None else np.array(seeds, dtype=np.int64)
    chunk = min(chunk or (count if checkpoint is None else CHUNK_BETWEEN_CHECKPOINTS), count)

    def part(start: int) -> tuple:
        """The arguments for the plans from `start` on; behind the last problem it is repeated."""
        numbers = np.minimum(np.arange(start, start + chunk), count - 1)
        piece = jax.tree.map(lambda leaf: leaf[numbers], (stacked, each, draws))
        return (
            piece,
            alike,
            None if seeds is not None else seed,
            lengths,
            step_factor,
            tolerances,
            with_history,
        )

    parts, done = [], 0
    if checkpoint is not None:
        checkpoint = Path(checkpoint)
        mark = fingerprint(
            problems[0], stacked, optimizer, settings, seed, step_factor, tolerances, *seeds or ()
        )
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


def _optimizers(
    problem: Problem, name: str, settings: Settings | Sequence[Settings], count: int
) -> tuple[list | None, Any, tuple]:
    """Optimizers and stops of the phases, alike for all or stacked for each, and the phases' numbers of steps."""
    one = not isinstance(settings, Sequence)
    sets = [settings] if one else list(settings)
    if not one and len(sets) != count:
        raise InputError(f"{len(sets)} settings were given for {count} problems; one for each is expected")
    phases = [search_of(problem, name, chosen)[0] for chosen in sets]
    lengths = [tuple(int(phase.stop.iterations) for phase in listed) for listed in phases]
    pairs = [[(phase.optimizer, phase.stop) for phase in listed] for listed in phases]
    if one:
        return pairs[0], None, lengths[0]
    other = first_unlike(pairs)
    if other is None:
        other = next((i for i, steps in enumerate(lengths) if steps != lengths[0]), None)
    if other is not None:
        raise InputError(
            f"settings {other} differ from settings 0 in more than numbers (the optimizer's sizes, or how many "
            f"steps it takes); plan it apart"
        )
    return (
        None,
        jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *pairs),
        lengths[0],
    )


@partial(jit, static_argnums=(3, 4, 5, 6))
def _plan_chunk(batch, alike, seed, lengths, step_factor, tolerances, with_history):
    def one(item: tuple) -> Plans:
        problem, own, draw = item
        searched = searchable(problem)
        optimizers = own if alike is None else alike
        key = jax.random.key(draw) if seed is None else jax.random.fold_in(jax.random.key(seed), draw)
        history = []
        population, evaluations, gradients = None, 0, 0
        for index, ((optimizer, stop), length) in enumerate(zip(optimizers, lengths, strict=True)):
            state = optimizer.init(jax.random.fold_in(key, index), searched, population)

            def step(state, _, optimizer=optimizer, stop=stop):
                done = stop.reached(state.progress)
                following = optimizer.step(searched, state)
                state = jax.tree.map(lambda old, new: jnp.where(done, old, new), state, following)
                now = state.progress
                counts = (now.evaluations, now.gradient_evaluations) if with_history else ()
                return state, (now.best_value, *counts)

            state, values = jax.lax.scan(step, state, length=length)
            spent = (evaluations, gradients)
            history.append(
                (values[0], *(before + part for before, part in zip(spent, values[1:], strict=False)))
            )
            evaluations += state.progress.evaluations
            gradients += state.progress.gradient_evaluations
            population = optimizer.population(state)
        free = state.progress.best_position
        motion, verification = verify(problem, free, step_factor)
        history = [jnp.concatenate(parts) for parts in zip(*history, strict=True)]
        ended = state.progress.converged | settled(history[0])
        return Plans(
            result=result_code(problem, verification, ended, tolerances),
            cost=found_index(
                problem,
                state.progress.best_value,
                problem.objective.value(problem.robot, motion),
                verification.measure,
            ),
            free=free,
            motion=motion,
            verification=verification,
            evaluations=jnp.asarray(evaluations),
            gradient_evaluations=jnp.asarray(gradients),
            history=PlanHistory(*history) if with_history else None,
        )

    return spread(one, batch, together=True)
