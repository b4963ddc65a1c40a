"""Searches in several phases: gradients from several starts, and a swarm followed by them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import Field, dataclass
from typing import Any

from jffsr.errors import InputError
from jffsr.optimizers.driver import Phase, Stop
from jffsr.optimizers.gradient import GradientDescent
from jffsr.optimizers.hyperparameters import choice, option_fields
from jffsr.optimizers.registry import GENERATIONAL, METHODS, Settings, built, swarm_of, swarm_phase, target


class Gradient:
    """Down the rounded index into a valley, then down the sharp one to its floor."""

    @staticmethod
    def option_fields(given: Mapping[str, Any]) -> dict[str, Field]:
        """The descent's tolerances."""
        return option_fields(GradientDescent)

    @staticmethod
    def phases(settings: Settings, options: Mapping[str, Any]) -> list[Phase]:
        """Both phases."""
        if settings.method not in METHODS:
            raise InputError(f"method '{settings.method}' is unknown; allowed are {', '.join(METHODS)}")
        return [
            Phase(
                name,
                built(GradientDescent, settings, **{**options, "looseness": looseness}),
                Stop(iterations=float(iterations), target=target(settings)),
            )
            for name, looseness, iterations in (
                ("gradient", settings.looseness, settings.gradient_iterations),
                ("polish", 1.0, settings.polish_iterations),
            )
        ]


@dataclass(frozen=True)
class _HybridOptions:
    swarm: str = choice("qpso", *GENERATIONAL)


class Hybrid:
    """A swarm, then gradients from the best of it."""

    @staticmethod
    def option_fields(given: Mapping[str, Any]) -> dict[str, Field]:
        """Which swarm, its options, and the descent's tolerances."""
        swarm = swarm_of(given)
        return {**option_fields(GradientDescent), **option_fields(swarm), **option_fields(_HybridOptions)}

    @staticmethod
    def phases(settings: Settings, options: Mapping[str, Any]) -> list[Phase]:
        """The swarm, and both phases of the descent."""
        ours = Gradient.option_fields(options)
        swarm = {k: v for k, v in options.items() if k not in ours and k != "swarm"}
        descent = {k: v for k, v in options.items() if k in ours}
        first = swarm_phase(options.get("swarm", "qpso"), settings, settings.swarm_evaluations, swarm)
        return [first, *Gradient.phases(settings, descent)]
