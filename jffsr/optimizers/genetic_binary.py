"""A genetic algorithm on strings of bits.

Holland, "Adaptation in natural and artificial systems", 1975; Goldberg, "Genetic algorithms in search, optimization
and machine learning", 1989. As Hu, Wang and Shi 2011 use it: 20 bits, roulette, crossover 0.8, mutation 0.01 for
each bit, and no elitism (`elitism` false).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.hyperparameters import choice, flag, number, size
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width
from jffsr.optimizers.randoms import uniforms
from jffsr.optimizers.selection import RANK, ROULETTE, TOURNAMENT, select
from jffsr.pytrees import register_dataclass
from jffsr.types import Array

ONE_POINT, UNIFORM = "one_point", "uniform"


@register_dataclass
@dataclass(frozen=True)
class BinaryGA(PopulationOptimizer):
    """Every number of a candidate is a code of `bits` bits, from 0 at its lower bound to all ones at its upper.

    Parents are selected by roulette, rank or tournament and mated in pairs with probability crossover_rate: their
    strings are cut at one point, or exchanged bit by bit (uniform). mutation_rate is that of each bit. With elitism
    the best parent takes the place of the worst child where it is better. All but the rates is static.
    """

    crossover_rate: Array | float = number(0.8, 0, 1)
    mutation_rate: Array | float = number(0.01, 0, 1)
    particles: int = field(default=50, metadata={"static": True})
    bits: int = size(20, 1, 30)
    selection: str = choice(ROULETTE, ROULETTE, RANK, TOURNAMENT)
    contestants: int = size(2, 2, 1000)
    crossover: str = choice(ONE_POINT, ONE_POINT, UNIFORM)
    elitism: bool = flag(True)

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, Any]:
        """The children, and the best parent with elitism."""
        return (*elite(state, value, self.elitism), state.own)

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """A generation of children."""
        choose, mate, mutate = jax.random.split(key, 3)
        lower, _, width = box_width(problem)
        pairs = -(-self.particles // 2)
        parents = select(choose, state.kept_value, 2 * pairs, self.selection, self.contestants)
        strings = self.encode((state.kept - lower) / jnp.where(width > 0, width, 1.0))
        strings = strings.reshape(self.particles, -1)[parents]
        one, two = strings[:pairs], strings[pairs:]
        swap = self._swapped(mate, one.shape)
        children = jnp.concatenate([jnp.where(swap, two, one), jnp.where(swap, one, two)])[: self.particles]
        children = children ^ (uniforms(mutate, children.shape) < self.mutation_rate)
        share = self.decode(children.reshape(*state.kept.shape, self.bits))
        return jnp.clip(lower + width * share, *problem.bounds()), state.own

    def _swapped(self, key: Array, shape: tuple[int, int]) -> Array:
        """Which bits a pair exchanges."""
        whether, where = jax.random.split(key)
        mated = uniforms(whether, (shape[0], 1)) < self.crossover_rate
        if self.crossover == UNIFORM:
            return mated & (uniforms(where, shape) < 0.5)
        cut = 1 + (uniforms(where, (shape[0], 1)) * (shape[1] - 1)).astype(int)
        return mated & (jnp.arange(shape[1]) >= cut)

    def encode(self, share: Array) -> Array:
        """Bits (..., bits), the largest first, of the code nearest to a share of the box in [0, 1]."""
        code = jnp.round(jnp.clip(share, 0.0, 1.0) * (2**self.bits - 1)).astype(jnp.uint32)
        return (code[..., None] >> jnp.arange(self.bits - 1, -1, -1, dtype=jnp.uint32)) & 1 == 1

    def decode(self, bits: Array) -> Array:
        """The share of the box, in [0, 1], that bits (..., bits) stand for."""
        weights = jnp.asarray(2.0, dtype=float) ** jnp.arange(self.bits - 1, -1, -1)
        return bits.astype(float) @ weights / (2**self.bits - 1)


def elite(state: PopulationState, value: Array, wanted: bool) -> tuple[Array, Array]:
    """The new candidates and values, the worst replaced by the best that was kept before where that is better."""
    if not wanted:
        return state.position, value
    best, worst = jnp.argmin(state.kept_value), jnp.argmax(value)
    saved = state.kept_value[best] < value[worst]
    return (
        state.position.at[worst].set(jnp.where(saved, state.kept[best], state.position[worst])),
        value.at[worst].set(jnp.where(saved, state.kept_value[best], value[worst])),
    )
