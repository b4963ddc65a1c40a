"""Members of a Pareto set polished by gradients, each on its own scalarisation, all in one batch.

A member with the values f0 descends the augmented Chebyshev function (Steuer and Choo, Mathematical Programming 26,
1983) whose corner is the member itself:

    max_k a_k + 0.01 sum_k a_k,   a_k = (f_k - z_k) / (f0_k - z_k),

z a little beyond the best of the front. All a_k are 1 at the member, and max a <= 1 means nothing but f <= f0: the
descent can only go where the member is dominated or equalled, also where the front is not convex, which sums with
weights cannot. For the gradient the maximum is rounded off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from jffsr.compiling import program
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.interface import Population
from jffsr.parallel.mapping import spread
from jffsr.pytrees import register_dataclass
from jffsr.spatial.safe import smooth_max
from jffsr.types import Array, Scalar, Vector

if TYPE_CHECKING:
    from jffsr.optimizers.pareto import MultiObjectiveProblem

_SUM = 0.01
_BEYOND = 0.1
# Looseness of the objectives and width of the rounded maximum, one after the other.
_STAGES = ((10.0, 1e-2), (1.0, 1e-3), (1.0, 1e-5))


@register_dataclass
@dataclass(frozen=True)
class Member:
    """The scalarisation of one member: its values (m,), the corner z (m,), the width of the rounded maximum, and
    the problem."""

    problem: MultiObjectiveProblem
    values: Vector
    corner: Vector
    width: Scalar | float

    def bounds(self) -> tuple[Vector, Vector]:
        """Those of the problem."""
        return self.problem.bounds()

    def value(self, candidate: Vector) -> Scalar:
        """The scalarisation; not a number where the member is worse in some objective than it was."""
        return self._value(self.problem.values(candidate))

    def _value(self, found: Vector) -> Scalar:
        ratio = self._ratio(found)
        return jnp.where(jnp.all(found <= self.values), jnp.max(ratio) + _SUM * jnp.sum(ratio), jnp.nan)

    def _ratio(self, found: Vector) -> Vector:
        return (found - self.corner) / (self.values - self.corner)

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The rounded scalarisation of the smooth objectives, and the exact one of the true ones."""
        smooth, found = self.problem.smooth_and_values(candidate, looseness)
        ratio = self._ratio(smooth)
        return smooth_max(ratio, self.width) + _SUM * jnp.sum(ratio), self._value(found)


@program(static_argnums=4)
def polished(
    problem: MultiObjectiveProblem, positions: Array, values: Array, key: Array, iterations: int
) -> tuple[Array, Array, Array]:
    """Positions (K, d) and values (K, m), none worse than it was in any objective, and gradients used (K,)."""
    least, most = jnp.min(values, axis=0), jnp.max(values, axis=0)
    reach = most - least
    corner = least - _BEYOND * jnp.where(reach > 0, reach, jnp.maximum(1.0, jnp.abs(least)))

    def one(item: tuple[Vector, Vector, Array]):
        position, value, own_key = item
        at_start = jnp.asarray(1.0 + _SUM * value.shape[0])

        def stage(best, setting):
            member = Member(problem, value, corner, setting[1])
            descent = GradientDescent(looseness=setting[0], starts=1)
            population = Population(best[0][None], best[1][None])

            def step(state, _):
                following = descent.step(member, state)
                held = state.progress.converged
                return jax.tree.map(lambda old, new: jnp.where(held, old, new), state, following), None

            state = descent.init(own_key, member, population)
            state, _ = jax.lax.scan(step, state, length=-(-iterations // len(_STAGES)))
            found = descent.population(state)
            return (found.positions[0], found.values[0]), state.progress.gradient_evaluations

        # One loop, so that the gradient is compiled once for all stages.
        (found, _), used = jax.lax.scan(stage, (position, at_start), jnp.array(_STAGES))
        # Evaluated again, and kept only where it still is no worse: the last bit may differ between programs.
        there = problem.values(found)
        better = jnp.all(there <= value) & jnp.any(there < value)
        return jnp.where(better, found, position), jnp.where(better, there, value), jnp.sum(used)

    keys = jax.random.split(key, positions.shape[0])
    return spread(one, (positions, values, keys), together=True)
