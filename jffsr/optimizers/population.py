"""What population methods share: each generation is evaluated, told apart by its values, and moved.

An algorithm is a dataclass with `particles` that says how it keeps (`keep`) and where it goes (`propose`).
Values are only compared or ranked, never added: they may span hundreds of powers of ten, or be infinite.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.interface import (
    OptimizationProblem,
    Population,
    Progress,
    better_of,
    finite_or_inf,
    no_progress,
    sample_box,
)
from jffsr.parallel.mapping import evaluate
from jffsr.pytrees import register_dataclass
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class PopulationState:
    """key; position (P, d), evaluated next; kept (P, d) and kept_value (P,), what the method goes by; `own`, what
    else the method remembers; progress."""

    key: Array
    position: Array
    kept: Array
    kept_value: Array
    own: Any
    progress: Progress


class PopulationOptimizer:
    """A method that evaluates `particles` candidates in each generation; see the module's text."""

    particles: int

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> PopulationState:
        """Candidates uniform in the box, a given population taking the first places; nothing is evaluated yet."""
        key, draw = jax.random.split(key)
        position = start_positions(draw, problem, self.particles, population)
        own = self.begin(problem, key, position)
        worst = jnp.full(self.particles, jnp.inf)
        return PopulationState(key, position, position, worst, own, no_progress(position[0]))

    def step(self, problem: OptimizationProblem, state: PopulationState) -> PopulationState:
        """One generation: P evaluations of the candidates, then where they go next."""
        return self.move(problem, self.assess(problem, state))

    def assess(self, problem: OptimizationProblem, state: PopulationState) -> PopulationState:
        """Evaluate the candidates and keep what the method keeps."""
        value = finite_or_inf(evaluate(problem.value, state.position))
        kept, kept_value, own = self.keep(state, value)
        old = state.progress
        best_position, best_value = better_of(old.best_position, old.best_value, state.position, value)
        progress = replace(
            old,
            best_position=best_position,
            best_value=best_value,
            iteration=old.iteration + 1,
            evaluations=old.evaluations + self.particles,
        )
        return PopulationState(state.key, state.position, kept, kept_value, own, progress)

    def move(self, problem: OptimizationProblem, state: PopulationState) -> PopulationState:
        """Where the next candidates stand."""
        generation = state.progress.iteration - 1
        key = jax.random.fold_in(state.key, generation)
        position, own = self.propose(problem, key, generation, state)
        return replace(state, position=position, own=own)

    def begin(self, problem: OptimizationProblem, key: Array, position: Array) -> Any:
        """What the method remembers at the start."""
        return ()

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, Any]:
        """The kept candidates, their values, and what is remembered: here, of each place the best so far."""
        improved = value < state.kept_value
        kept = jnp.where(improved[:, None], state.position, state.kept)
        return kept, jnp.where(improved, value, state.kept_value), state.own

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """The next candidates, all in the box, and what is remembered; generations count from 0."""
        raise TypeError(f"{type(self).__name__} does not say where its candidates go")

    def population(self, state: PopulationState) -> Population:
        """What is kept."""
        return Population(state.kept, state.kept_value)


def start_positions(
    key: Array, problem: OptimizationProblem, count: int, population: Population | None
) -> Array:
    """Candidates (count, d) uniform in the box; a given population comes first, the best of it where it is larger."""
    position = sample_box(key, problem, count)
    if population is None:
        return position
    given = population.positions
    if given.shape[0] > count:
        given = given[jnp.argsort(finite_or_inf(population.values))[:count]]
    lower, upper = problem.bounds()
    return position.at[: given.shape[0]].set(jnp.clip(given, lower, upper))


def box_width(problem: OptimizationProblem) -> tuple[Array, Array, Array]:
    """Lower bounds, upper bounds and their differences (d,)."""
    lower, upper = (jnp.asarray(bound, dtype=float) for bound in problem.bounds())
    return lower, upper, upper - lower


def fraction_done(generation: Array, generations: Array | float) -> Array:
    """The share in [0, 1] of the generations that have passed."""
    return jnp.clip(generation / jnp.maximum(generations, 1), 0.0, 1.0)
