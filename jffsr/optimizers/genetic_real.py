"""A genetic algorithm on real numbers.

Simulated binary crossover: Deb and Agrawal, "Simulated binary crossover for continuous search space", Complex
Systems 9, 1995; blend crossover: Eshelman and Schaffer, "Real-coded genetic algorithms and interval-schemata",
Foundations of Genetic Algorithms 2, 1993; polynomial mutation: Deb and Goyal, "A combined genetic adaptive search
(GeneAS) for engineering design", Computer Science and Informatics 26(4), 1996.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.genetic_binary import elite
from jffsr.optimizers.hyperparameters import choice, flag, number, size
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width
from jffsr.optimizers.randoms import uniforms
from jffsr.optimizers.selection import RANK, ROULETTE, TOURNAMENT, select
from jffsr.pytrees import register_dataclass
from jffsr.types import Array

SBX, BLEND = "sbx", "blend"


@register_dataclass
@dataclass(frozen=True)
class RealGA(PopulationOptimizer):
    """Parents are selected and mated in pairs with probability crossover_rate; children are clipped to the box.

    crossover: sbx, with children as near their parents as crossover_index is large; or blend, with children uniform
    in the parents' interval lengthened by blend_margin of its length at both ends. A child has `mutations` numbers
    changed on average, by a share of the box that is small where mutation_index is large. With elitism the best
    parent takes the place of the worst child where it is better. Sizes, names and elitism are static.
    """

    crossover_rate: Array | float = number(0.9, 0, 1)
    crossover_index: Array | float = number(10.0, 0, 1e3)
    blend_margin: Array | float = number(0.5, 0, 10)
    mutations: Array | float = number(1.0, 0, 1e6)
    mutation_index: Array | float = number(20.0, 0, 1e3)
    particles: int = field(default=50, metadata={"static": True})
    selection: str = choice(TOURNAMENT, ROULETTE, RANK, TOURNAMENT)
    contestants: int = size(2, 2, 1000)
    crossover: str = choice(SBX, SBX, BLEND)
    elitism: bool = flag(True)

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, Any]:
        """The children, and the best parent with elitism."""
        return (*elite(state, value, self.elitism), state.own)

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """A generation of children."""
        choose, whether, spread, mutate = jax.random.split(key, 4)
        lower, upper, width = box_width(problem)
        pairs = -(-self.particles // 2)
        chosen = select(choose, state.kept_value, 2 * pairs, self.selection, self.contestants)
        one, two = state.kept[chosen[:pairs]], state.kept[chosen[pairs:]]
        mated = uniforms(whether, (pairs, 1)) < self.crossover_rate
        first, second = self.cross(spread, one, two)
        children = jnp.concatenate([jnp.where(mated, first, one), jnp.where(mated, second, two)])
        children = children[: self.particles]
        # Random numbers are most of the cost: one that falls below the rate is, over the rate, uniform again.
        draw = jax.lax.optimization_barrier(uniforms(mutate, children.shape))
        rate = jnp.minimum(self.mutations / children.shape[1], 1.0)
        mutated = draw < rate
        change = polynomial(
            jnp.where(mutated, draw / jnp.where(rate > 0, rate, 1.0), 0.5), self.mutation_index
        )
        change = jax.lax.optimization_barrier(change)
        children = jnp.where(mutated, children + width * change, children)
        return jnp.clip(children, lower, upper), state.own

    def cross(self, key: Array, one: Array, two: Array) -> tuple[Array, Array]:
        """Two children of each pair of parents (k, d)."""
        if self.crossover == BLEND:
            low, length = jnp.minimum(one, two), jnp.abs(one - two)
            places = uniforms(key, (2, *one.shape)) * (1 + 2 * self.blend_margin) - self.blend_margin
            return low + places[0] * length, low + places[1] * length
        # Half of the numbers change sides, so that a child is not near the same parent in all of them. The first
        # digit of a draw says which, the others are a draw again.
        # Barriers, since XLA would compute draws and logarithms once for each child: half of a generation's time.
        draws = jax.lax.optimization_barrier(2 * uniforms(key, one.shape))
        swap = draws >= 1
        factor = jax.lax.optimization_barrier(spread_factor(draws - swap, self.crossover_index))
        middle, half = (one + two) / 2, factor * (two - one) / 2
        half = jnp.where(swap, -half, half)
        return middle - half, middle + half


def spread_factor(uniform: Array, index: Array | float) -> Array:
    """The children's distance over their parents' in simulated binary crossover."""
    base = jnp.where(uniform <= 0.5, 2 * uniform, 1 / (2 * (1 - uniform)))
    return jnp.exp(jnp.log(base) / (index + 1))


def polynomial(uniform: Array, index: Array | float) -> Array:
    """The change in polynomial mutation, in (-1, 1), from a number uniform in (0, 1)."""
    low = uniform < 0.5
    root = jnp.exp(jnp.log(jnp.where(low, 2 * uniform, 2 * (1 - uniform))) / (index + 1))
    return jnp.where(low, root - 1, 1 - root)
