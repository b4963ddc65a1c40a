"""Particle swarm optimization, with a constriction factor or with inertia.

Kennedy and Eberhart, "Particle swarm optimization", Int. Conf. on Neural Networks 1995; the constriction factor and
its constants 0.7298 and 1.4962: Clerc and Kennedy, "The particle swarm - explosion, stability, and convergence in a
multidimensional complex space", IEEE Trans. Evolutionary Computation 6(1), 2002; inertia that falls linearly: Shi
and Eberhart, "Empirical study of particle swarm optimization", Congress on Evolutionary Computation 1999; inertia
from the share of particles that bettered themselves: Nickabadi, Ebadzadeh and Safabakhsh, "A novel particle swarm
optimization algorithm with adaptive inertia weight", Applied Soft Computing 11(4), 2011.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

from jffsr.optimizers.hyperparameters import choice, flag, number
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.population import PopulationOptimizer, PopulationState, box_width, fraction_done
from jffsr.optimizers.randoms import uniform_pairs, uniforms
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class PSO(PopulationOptimizer):
    """The swarm with velocities; the default is the constricted one of Clerc and Kennedy.

    rule: `constant` uses inertia, cognitive and social; `constriction` computes all three from phi > 4; `linear` lets
    the inertia fall from inertia_start to inertia_end over `iterations`; `success` sets it between these two by the
    share of particles that bettered their best last time. A velocity is at most velocity_limit box widths; a particle
    that would leave the box stops at its bound with no velocity across it. With shared_draws a particle draws one
    random weight for each pull, not one for each number. particles, rule and shared_draws are static.
    """

    iterations: Array | float
    inertia: Array | float = number(0.7298, 0, 1)
    cognitive: Array | float = number(1.4962, 0, 10)
    social: Array | float = number(1.4962, 0, 10)
    phi: Array | float = number(4.1, 4, 10, inside=True)
    inertia_start: Array | float = number(0.9, 0, 1)
    inertia_end: Array | float = number(0.4, 0, 1)
    velocity_limit: Array | float = number(0.5, 0, 1e3, inside=True)
    particles: int = field(default=50, metadata={"static": True})
    rule: str = choice("constant", "constant", "constriction", "linear", "success")
    shared_draws: bool = flag(False)

    def begin(self, problem: OptimizationProblem, key: Array, position: Array) -> tuple[Array, Array]:
        """Velocities (P, d) half of the way to a random place, and the share of successes."""
        lower, _, width = box_width(problem)
        aim = lower + width * uniforms(jax.random.fold_in(key, 2**31 - 1), position.shape)
        return (aim - position) / 2, jnp.ones(())

    def keep(self, state: PopulationState, value: Array) -> tuple[Array, Array, tuple]:
        """The best place of each particle, and how many found a better one."""
        kept, kept_value, (velocity, _) = super().keep(state, value)
        return kept, kept_value, (velocity, jnp.mean(value < state.kept_value, dtype=float))

    def coefficients(self, generation: Array, success: Array) -> tuple[Scalar, Scalar, Scalar]:
        """Inertia, and the pulls to a particle's own best and to the swarm's."""
        if self.rule == "constriction":
            factor = 2 / jnp.abs(2 - self.phi - jnp.sqrt(self.phi**2 - 4 * self.phi))
            return factor, factor * self.phi / 2, factor * self.phi / 2
        share = {"linear": 1 - fraction_done(generation, self.iterations), "success": success}.get(self.rule)
        if share is None:
            return self.inertia, self.cognitive, self.social
        return self.inertia_end + (self.inertia_start - self.inertia_end) * share, self.cognitive, self.social

    def propose(
        self, problem: OptimizationProblem, key: Array, generation: Array, state: PopulationState
    ) -> tuple[Array, tuple]:
        """Each particle one velocity further."""
        velocity, success = state.own
        inertia, cognitive, social = self.coefficients(generation, success)
        count, dimensions = state.position.shape
        # Kept apart from what they are used in, so that no draw is computed twice.
        draws = uniform_pairs(key, (count, 1 if self.shared_draws else dimensions))
        own, common = jax.lax.optimization_barrier(draws)
        lower, upper, width = box_width(problem)
        velocity = (
            inertia * velocity
            + cognitive * own * (state.kept - state.position)
            + social * common * (state.progress.best_position - state.position)
        )
        velocity = jnp.clip(velocity, -self.velocity_limit * width, self.velocity_limit * width)
        aim = state.position + velocity
        position = jnp.clip(aim, lower, upper)
        return position, (jnp.where(position == aim, velocity, 0.0), success)
