"""Differential evolution with binomial crossover.

Storn and Price, "Differential evolution - a simple and efficient heuristic for global optimization over continuous
spaces", J. Global Optimization 11, 1997 (rand/1, current-to-best/1); the base drawn from the best share of the
population (pbest) and the repair halfway to the bound: Zhang and Sanderson, "JADE: adaptive differential evolution
with optional external archive", IEEE Trans. Evolutionary Computation 13(5), 2009.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.hyperparameters import choice, number
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width
from jffsr.optimizers.randoms import distinct_others, uniforms
from jffsr.pytrees import register_dataclass
from jffsr.types import Array

RAND, PBEST, CURRENT_TO_BEST = "rand", "pbest", "current_to_best"
SMALLEST = 4  # members that differ from each other in a rand/1 mutant


@register_dataclass
@dataclass(frozen=True)
class DE(PopulationOptimizer):
    """Each member's rival is a mutant crossed with it, and takes its place where it is no worse.

    strategy: rand (x_r1 + F (x_r2 - x_r3)), pbest (x_p + F (x_r1 - x_r2), x_p among the best share `best_share`), or
    current_to_best (x + F (x_best - x) + F (x_r1 - x_r2)); F is `factor`. A number comes from the mutant with
    probability `crossover`, one always does. A number outside the box goes halfway from its parent to the bound.
    particles (at least 4) and strategy are static.
    """

    factor: Array | float = number(0.5, 0, 2, inside=True)
    crossover: Array | float = number(0.9, 0, 1)
    best_share: Array | float = number(0.1, 0, 1)
    particles: int = field(default=50, metadata={"static": True, "smallest": SMALLEST})
    strategy: str = choice(RAND, RAND, PBEST, CURRENT_TO_BEST)

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, Any]:
        """A rival that is no worse replaces its parent: also on a plateau, which it may so cross."""
        wins = value <= state.kept_value
        kept = jnp.where(wins[:, None], state.position, state.kept)
        return kept, jnp.where(wins, value, state.kept_value), state.own

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """A rival for each member."""
        mutation, cross = jax.random.split(key)
        rivals = mutants(mutation, state, self.factor, self.best_share, (self.strategy,))[0]
        lower, upper, _ = box_width(problem)
        rivals = jnp.where(rivals < lower, (lower + state.kept) / 2, rivals)
        rivals = jnp.where(rivals > upper, (upper + state.kept) / 2, rivals)
        return binomial(cross, state.kept, rivals, self.crossover), state.own


def mutants(
    key: Array,
    state: PopulationState,
    factor: Array | float,
    best_share: Array | float,
    kinds: tuple[str, ...],
) -> list[Array]:
    """Mutants (P, d) of each strategy asked for, from the same draws; factor is a number or (P, 1)."""
    x, best = state.kept, state.progress.best_position
    count = x.shape[0]
    others, shares = jax.random.split(key)
    one, two, three = distinct_others(others, count, 3)
    found = []
    for kind in kinds:
        if kind == RAND:
            found.append(x[one] + factor * (x[two] - x[three]))
        elif kind == PBEST:
            among = jnp.maximum(1, jnp.ceil(best_share * count))
            place = (uniforms(shares, (count,)) * among).astype(int)
            base = x[jnp.argsort(state.kept_value)[place]]
            found.append(base + factor * (x[one] - x[two]))
        else:
            found.append(x + factor * (best - x) + factor * (x[one] - x[two]))
    return found


def binomial(key: Array, parents: Array, rivals: Array, rate: Array | float) -> Array:
    """Each number from the rival with probability `rate` (a number or (P, 1)), one of them for certain."""
    draws = uniforms(key, (parents.shape[0], parents.shape[1] + 1))
    certain = (draws[:, -1:] * parents.shape[1]).astype(int) == jnp.arange(parents.shape[1])
    return jnp.where((draws[:, :-1] < rate) | certain, rivals, parents)
