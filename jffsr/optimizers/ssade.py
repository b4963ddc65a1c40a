"""Strategy self-adaptive differential evolution: the mutation follows the stage of the search.

Ye, Dong and Hong, "Research on adaptive reaction null space planning and control strategy based on VFF-RLS and
SSADE-ELM algorithm for free-floating space robot", Electronics 8, 1111, 2019, equations (36) to (44). Where ours
differs: a rival wins by its value alone (the printed rule, which also asks for smaller weights, can stall); the
second factor of current-to-best/1 equals the first; and pbest is drawn from the best share of the population, since
with this selection the best that a member has ever been is the member itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.de import CURRENT_TO_BEST, DE, PBEST, RAND, SMALLEST, binomial, mutants
from jffsr.optimizers.hyperparameters import number
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width
from jffsr.optimizers.randoms import uniforms
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class SSADE(PopulationOptimizer):
    """Differential evolution by stages: rand/1 while spread out, pbest/1 between, current-to-best/1 when gathered.

    The stage is told by the members' mean distance to the best, in box widths, over the largest it has been: above
    `stage`, between 1 - stage and stage, or below. The factor of each member is drawn from a Cauchy distribution
    (factor_median, factor_scale) cut to (0, 1], its crossover rate from a normal one (crossover_mean, crossover_std)
    clipped to [0, 1]. A number outside the box is drawn again, uniform in it. particles (at least 4) is static.
    """

    stage: Array | float = number(0.85, 0.5, 1)
    factor_median: Array | float = number(0.5, 0, 2, inside=True)
    factor_scale: Array | float = number(0.1, 0, 2, inside=True)
    crossover_mean: Array | float = number(0.5, 0, 1)
    crossover_std: Array | float = number(0.3, 0, 2)
    best_share: Array | float = number(0.1, 0, 1)
    particles: int = field(default=50, metadata={"static": True, "smallest": SMALLEST})

    keep = DE.keep

    def begin(self, problem: OptimizationProblem, key: Array, position: Array) -> Array:
        """The largest mean distance so far."""
        return jnp.zeros(())

    def stage_number(self, ratio: Array) -> Array:
        """1, 2 or 3, by the mean distance over its maximum, equation (39)."""
        return jnp.where(ratio > self.stage, 1, jnp.where(ratio >= 1 - self.stage, 2, 3))

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, Any]:
        """A rival for each member, by the strategy of the stage."""
        lower, upper, width = box_width(problem)
        distance = mean_distance(state.kept, state.progress.best_position, width)
        largest = jnp.maximum(state.own, distance)
        stage = self.stage_number(
            jnp.where(largest > 0, distance / jnp.where(largest > 0, largest, 1.0), 0.0)
        )
        mutation, numbers, rates, again, cross = jax.random.split(key, 5)
        factor = self.draw_factor(uniforms(numbers, (self.particles, 1)))
        rate = self.crossover_mean + self.crossover_std * jax.random.normal(rates, (self.particles, 1))
        first, second, third = mutants(
            mutation, state, factor, self.best_share, (RAND, PBEST, CURRENT_TO_BEST)
        )
        rivals = jnp.where(stage == 1, first, jnp.where(stage == 2, second, third))
        fresh = lower + width * uniforms(again, rivals.shape)
        rivals = jnp.where((rivals < lower) | (rivals > upper), fresh, rivals)
        return binomial(cross, state.kept, rivals, jnp.clip(rate, 0.0, 1.0)), largest

    def draw_factor(self, uniform: Array) -> Array:
        """Cauchy variables from uniform ones: those at or below 0 count as drawn again, those above 1 as 1."""
        below = 0.5 - jnp.arctan(self.factor_median / self.factor_scale) / jnp.pi
        # Far out in the tail the factor is 1 anyway, and the tangent could turn over.
        quantile = jnp.minimum(below + (1 - below) * uniform, 1 - 1e-4)
        factor = self.factor_median + self.factor_scale * jnp.tan(jnp.pi * (quantile - 0.5))
        return jnp.clip(factor, 1e-12, 1.0)


def mean_distance(members: Array, best: Array, width: Array) -> Scalar:
    """Mean distance of members (P, d) to the best (d,), in widths of the box, equation (36)."""
    gap = (members - best) / jnp.where(width > 0, width, 1.0)
    return jnp.mean(jnp.sqrt(jnp.sum(gap**2, axis=1)))
