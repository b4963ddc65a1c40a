"""A swarm with gradient steps inside: every few generations the best members go downhill.

Moscato, "On evolution, search, optimization, genetic algorithms and martial arts: towards memetic algorithms",
Caltech Concurrent Computation Program report 826, 1989. What the descent finds takes the member's place
(Lamarckian learning) and is what the swarm goes by from then on.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, replace
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.hyperparameters import choice, option_fields, size
from jffsr.optimizers.interface import OptimizationProblem, Population, better_of
from jffsr.optimizers.population import PopulationOptimizer, PopulationState
from jffsr.optimizers.registry import GENERATIONAL, Settings, built, swarm_of, swarm_phase
from jffsr.pytrees import register_dataclass
from jffsr.types import Array


@dataclass(frozen=True)
class _Options:
    """Options beside those of the swarm that is chosen."""

    swarm: str = choice("qpso", *GENERATIONAL)
    period: int = size(10, 1, 10**9)
    steps: int = size(5, 1, 1000)


@register_dataclass
@dataclass(frozen=True)
class Memetic:
    """A population method of which, every `period` generations, the best members make `steps` gradient steps.

    descent says how many members, and how they descend; its gradient evaluations are counted apart from the swarm's
    evaluations. steps is static.
    """

    swarm: PopulationOptimizer
    descent: GradientDescent
    period: Array | float = 10
    steps: int = field(default=5, metadata={"static": True})

    @property
    def particles(self) -> int:
        """The members of the swarm."""
        return self.swarm.particles

    @staticmethod
    def option_fields(given: Mapping[str, Any]) -> dict[str, Field]:
        """Its own options and those of the swarm that is chosen."""
        own = option_fields(_Options)
        return {**option_fields(swarm_of(given)), **own}

    @staticmethod
    def phases(settings: Settings, options: Mapping[str, Any]) -> list:
        """One phase: a swarm of the settings' budget with descents on the loosened index inside."""
        rest = {name: value for name, value in options.items() if name not in ("swarm", "period", "steps")}
        phase = swarm_phase(options.get("swarm", "qpso"), settings, settings.evaluations, rest)
        descent = built(GradientDescent, settings, starts=min(settings.starts, settings.particles))
        chosen = _Options(**{name: options[name] for name in ("period", "steps") if name in options})
        whole = Memetic(phase.optimizer, descent, period=float(chosen.period), steps=chosen.steps)
        return [replace(phase, name="memetic", optimizer=whole)]

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> PopulationState:
        """The swarm's own start."""
        return self.swarm.init(key, problem, population)

    def step(self, problem: OptimizationProblem, state: PopulationState) -> PopulationState:
        """One generation, with a descent before the move where it is time for one."""
        state = self.swarm.assess(problem, state)
        due = jnp.mod(state.progress.iteration, self.period) == 0
        state = jax.lax.cond(due, lambda s: self._descend(problem, s), lambda s: s, state)
        return self.swarm.move(problem, state)

    def _descend(self, problem: OptimizationProblem, state: PopulationState) -> PopulationState:
        key = jax.random.fold_in(jax.random.fold_in(state.key, state.progress.iteration), 1)
        # The descent begins with the best, in this order.
        chosen = jnp.argsort(state.kept_value)[: self.descent.starts]
        start = self.descent.init(key, problem, Population(state.kept[chosen], state.kept_value[chosen]))
        end = jax.lax.scan(lambda s, _: (self.descent.step(problem, s), None), start, length=self.steps)[0]
        found = self.descent.population(end)
        progress = state.progress
        best_position, best_value = better_of(
            progress.best_position, progress.best_value, found.positions, found.values
        )
        progress = replace(
            progress,
            best_position=best_position,
            best_value=best_value,
            gradient_evaluations=progress.gradient_evaluations + end.progress.gradient_evaluations,
        )
        return replace(
            state,
            kept=state.kept.at[chosen].set(found.positions),
            kept_value=state.kept_value.at[chosen].set(found.values),
            progress=progress,
        )

    def population(self, state: PopulationState) -> Population:
        """The swarm's."""
        return self.swarm.population(state)
