"""Who searches: every registered optimizer, with what it needs to spend one budget."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from jffsr.optimizers.driver import Phase
from jffsr.optimizers.registry import Settings, build_phases

MEMBERS = 50
STARTS = 4
_SWARM_SHARE = 0.1


@dataclass(frozen=True)
class Search:
    """An optimizer by its registered name, its label in tables, and options that are not its defaults.

    gradients says whether it takes gradients, which are charged.
    """

    label: str
    kind: str
    options: dict[str, Any] = field(default_factory=dict)
    gradients: bool = False

    def phases(self, budget: float, charge: float) -> list[Phase]:
        """Its phases for a budget in evaluations, a gradient being charged that many."""
        return build_phases(self.kind, self._settings(budget, charge))

    def _settings(self, budget: float, charge: float) -> Settings:
        if not self.gradients:
            return Settings(particles=MEMBERS, evaluations=int(budget), options=self.options)
        if self.kind == "memetic":
            period, steps = self.options["period"], self.options["steps"]
            # Of every `period` generations one goes downhill.
            generation = MEMBERS + charge * STARTS * steps / period
            generations = max(int(budget / generation), 1)
            return Settings(
                particles=MEMBERS, evaluations=MEMBERS * generations, starts=STARTS, options=self.options
            )
        swarm = int(_SWARM_SHARE * budget) if self.kind == "hybrid" else 0
        steps = int((budget - swarm) / (charge * STARTS))
        return Settings(
            particles=MEMBERS,
            swarm_evaluations=max(swarm, MEMBERS),
            starts=STARTS,
            gradient_iterations=2 * steps // 3,
            polish_iterations=steps - 2 * steps // 3,
            options=self.options,
        )


SEARCHES = (
    Search("QPSO", "qpso"),
    Search("QPSO, weighted mean", "qpso", {"mean_best": "weighted"}),
    Search("PSO, constriction", "pso", {"rule": "constriction"}),
    Search("PSO, adaptive inertia", "pso", {"rule": "success"}),
    Search("GA, binary", "ga_binary"),
    Search("GA, real", "ga"),
    Search("DE/rand/1", "de", {"strategy": "rand"}),
    Search("DE/pbest/1", "de", {"strategy": "pbest"}),
    Search("DE/current-to-best/1", "de", {"strategy": "current_to_best"}),
    Search("SSADE", "ssade"),
    Search("CMA-ES", "cma_es"),
    Search("gradient, multi-start", "gradient", gradients=True),
    Search("hybrid", "hybrid", gradients=True),
    Search("memetic", "memetic", {"period": 5, "steps": 5}, gradients=True),
)
