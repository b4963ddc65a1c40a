"""Quantum-behaved particle swarm optimization.

Sun, Feng and Xu, "Particle swarm optimization with particles having quantum behavior", Congress on
Evolutionary Computation 2004, as Li 2022 uses it, with what its steps misprint put right: the best is the
arg min, the weight of the local attractor is drawn uniformly for each dimension, and the mean runs over the
personal bests of the whole swarm. The weighted mean is that of Xi, Sun and Xu, "An improved quantum-behaved
particle swarm optimization algorithm with weighted mean best position", Applied Mathematics and Computation
205, 2008: better particles count more, from 1.5 down to 0.5 by rank.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import optax

from jffsr.optimizers.hyperparameters import choice, number
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, fraction_done
from jffsr.optimizers.registry import LARGEST_CONTRACTION
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar

RANK_WEIGHTS = (1.5, 0.5)
"""Weights of the best and the worst particle in the weighted mean; those between fall linearly, their mean is 1."""


@register_dataclass
@dataclass(frozen=True)
class QPSO(PopulationOptimizer):
    """The swarm; every particle moves about its attractor by a Laplace step of the mean best distance.

    Over `iterations` the contraction-expansion coefficient goes from contraction_start to contraction_end (it must
    stay under exp(0.5772) = 1.781 for the swarm to contract), linearly, along a cosine or exponentially; `schedule`,
    any optax schedule (generation -> coefficient), takes the place of all that. mean_best is plain, or weighted by
    rank. A particle that would leave the box stops at its bound.
    particles, shape, mean_best and schedule are static.
    """

    iterations: Array | float
    contraction_start: Array | float = number(1.0, 0, LARGEST_CONTRACTION, inside=True)
    contraction_end: Array | float = number(0.5, 0, LARGEST_CONTRACTION, inside=True)
    particles: int = field(default=50, metadata={"static": True})
    shape: str = choice("linear", "linear", "cosine", "exponential", "constant")
    mean_best: str = choice("plain", "plain", "weighted")
    schedule: Callable[[Array], Array] | None = field(default=None, metadata={"static": True})

    def contraction(self, generation: Array) -> Scalar:
        """The contraction-expansion coefficient of a generation, counted from 0."""
        if self.schedule is not None:
            return self.schedule(generation)
        start, end = self.contraction_start, self.contraction_end
        fraction = fraction_done(generation, self.iterations)
        if self.shape == "cosine":
            return end + (start - end) * optax.cosine_decay_schedule(1.0, 1)(fraction)
        if self.shape == "exponential":
            return start * (end / start) ** fraction
        if self.shape == "constant":
            return jnp.asarray(start, dtype=float)
        return start + (end - start) * fraction

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, tuple]:
        """Each particle about its attractor, between its own best and the swarm's."""
        contraction = self.contraction(generation)
        mix, leap = jax.random.split(key)
        phi = jax.random.uniform(mix, state.position.shape)
        attractor = phi * state.kept + (1 - phi) * state.progress.best_position
        # A random sign times log(1/u), u uniform in (0, 1], is a Laplace variable: one draw instead of two.
        jump = jnp.abs(self._mean_best(state) - state.position) * jax.random.laplace(
            leap, state.position.shape
        )
        lower, upper = problem.bounds()
        return jnp.clip(attractor + contraction * jump, lower, upper), state.own

    def _mean_best(self, state: PopulationState) -> Array:
        if self.mean_best == "plain":
            return jnp.mean(state.kept, axis=0)
        falling = jnp.linspace(*RANK_WEIGHTS, self.particles)
        weight = jnp.zeros(self.particles).at[jnp.argsort(state.kept_value)].set(falling)
        return weight @ state.kept / self.particles
