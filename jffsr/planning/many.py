"""Many problems of one shape planned in one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.planning.plan import check_precision
from jffsr.planning.problem import Problem
from jffsr.planning.result import Tolerances, result_code, settled
from jffsr.planning.verification import Verification, verify
from jffsr.robots.stacking import first_unlike
from jffsr.rollouts.motion import Motion
from jffsr.types import Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Plans:
    """A batch of verified plans, leading axis (K,) on every array.

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
) -> Plans:
    """Plan problems that differ only in numbers (robots of one topology, tasks, limits, momenta) at once.

    The search, the re-run and the verdict of all of them are one vmapped program. Every problem uses its
    whole budget, unless it reaches the settings' target, from where its state stands still. Raises InputError
    where the problems are of different structure or shape.
    """
    problems = list(problems)
    if not problems:
        raise InputError("plan_many was given no problem")
    other = first_unlike(problems)
    if other is not None:
        raise InputError(
            f"problem {other} differs from problem 0 in more than numbers (its robot's topology or names, its "
            f"terms, num_steps, or the shape of an array); plan it apart"
        )
    check_precision("float64")
    stacked = jax.tree.map(lambda *leaves: jnp.stack([jnp.asarray(leaf) for leaf in leaves]), *problems)
    phases = build_phases(optimizer, settings or Settings())
    lengths = tuple(int(phase.stop.iterations) for phase in phases)
    keys = jax.random.split(jax.random.key(seed), len(problems))
    optimizers = [(phase.optimizer, phase.stop) for phase in phases]
    tolerances = tolerances or Tolerances()
    return _plan_batch(stacked, optimizers, keys, lengths, step_factor, tolerances)


@partial(jit, static_argnums=(3, 4, 5))
def _plan_batch(problems, optimizers, keys, lengths, step_factor, tolerances):
    def one(problem: Problem, key: Array) -> Plans:
        population, evaluations, gradients, best = None, 0, 0, []
        for index, ((optimizer, stop), length) in enumerate(zip(optimizers, lengths, strict=True)):
            state = optimizer.init(jax.random.fold_in(key, index), problem, population)

            def step(state, _, optimizer=optimizer, stop=stop):
                done = stop.reached(state.progress)
                following = optimizer.step(problem, state)
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
            cost=state.progress.best_value,
            free=free,
            motion=motion,
            verification=verification,
            evaluations=jnp.asarray(evaluations),
            gradient_evaluations=jnp.asarray(gradients),
        )

    return jax.vmap(one)(problems, keys)
