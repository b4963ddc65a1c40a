"""Quantum-behaved particle swarm optimization.

Sun, Feng and Xu, "Particle swarm optimization with particles having quantum behavior", Congress on
Evolutionary Computation 2004, as Li 2022 uses it, with what its steps misprint put right: the best is the
arg min, the weight of the local attractor is drawn uniformly for each dimension, and the mean runs over the
personal bests of the whole swarm.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

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
from jffsr.types import Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SwarmState:
    """key; position (P, d), personal_best (P, d), personal_value (P,)."""

    key: Array
    position: Array
    personal_best: Array
    personal_value: Array
    progress: Progress


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class QPSO:
    """The swarm; every particle moves about its attractor by a Laplace step of the mean best distance.

    iterations, over which the contraction-expansion coefficient falls linearly from contraction_start to
    contraction_end (it must stay under exp(0.5772) = 1.781 for the swarm to contract); particles is static.
    """

    iterations: Array | float
    contraction_start: Array | float = 1.0
    contraction_end: Array | float = 0.5
    particles: int = field(default=50, metadata={"static": True})

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> SwarmState:
        """A swarm uniform in the box, a given population taking the first places; nothing is evaluated yet."""
        key, draw = jax.random.split(key)
        position = sample_box(draw, problem, self.particles)
        if population is not None:
            given = population.positions[: self.particles]
            position = position.at[: given.shape[0]].set(given)
        progress = no_progress(position[0])
        return SwarmState(key, position, position, jnp.full(self.particles, jnp.inf), progress)

    def step(self, problem: OptimizationProblem, state: SwarmState) -> SwarmState:
        """One generation: P evaluations where the swarm stands, then the move to where it goes next."""
        progress = state.progress
        value = finite_or_inf(evaluate(problem.value, state.position))
        improved = value < state.personal_value
        personal_best = jnp.where(improved[:, None], state.position, state.personal_best)
        personal_value = jnp.where(improved, value, state.personal_value)
        best_position, best_value = better_of(
            progress.best_position, progress.best_value, personal_best, personal_value
        )
        position = self._move(problem, state, personal_best, best_position)
        progress = replace(
            progress,
            best_position=best_position,
            best_value=best_value,
            iteration=progress.iteration + 1,
            evaluations=progress.evaluations + self.particles,
        )
        return SwarmState(state.key, position, personal_best, personal_value, progress)

    def _move(self, problem: OptimizationProblem, state: SwarmState, personal_best, best_position) -> Array:
        iteration = state.progress.iteration
        fraction = jnp.clip(iteration / jnp.maximum(self.iterations, 1), 0.0, 1.0)
        contraction = self.contraction_start + (self.contraction_end - self.contraction_start) * fraction
        mix, leap = jax.random.split(jax.random.fold_in(state.key, iteration))
        phi = jax.random.uniform(mix, state.position.shape)
        attractor = phi * personal_best + (1 - phi) * best_position
        mean_best = jnp.mean(personal_best, axis=0)
        # A random sign times log(1/u), u uniform in (0, 1], is a Laplace variable: one draw instead of two.
        jump = jnp.abs(mean_best - state.position) * jax.random.laplace(leap, state.position.shape)
        lower, upper = problem.bounds()
        return jnp.clip(attractor + contraction * jump, lower, upper)

    def population(self, state: SwarmState) -> Population:
        """The personal bests."""
        return Population(state.personal_best, state.personal_value)
