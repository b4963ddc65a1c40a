"""Optimizers by name: an algorithm is one file and one line here.

A line names a class as `module:Class`, loaded when it is asked for, so that the names can be had without JAX. A
population method (GENERATIONAL) is a dataclass whose fields say what its options are; the settings fill the
fields of their own names. Other classes say themselves which phases they make and which options they take.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

from jffsr.errors import InputError
from jffsr.optimizers.hyperparameters import Option, option_fields, read_options
from jffsr.reading.did_you_mean import hint

if TYPE_CHECKING:
    from jffsr.optimizers.driver import Phase

GENERATIONAL: dict[str, str] = {
    "qpso": "jffsr.optimizers.qpso:QPSO",
    "pso": "jffsr.optimizers.pso:PSO",
    "ga": "jffsr.optimizers.genetic_real:RealGA",
    "ga_binary": "jffsr.optimizers.genetic_binary:BinaryGA",
    "de": "jffsr.optimizers.de:DE",
    "ssade": "jffsr.optimizers.ssade:SSADE",
    "cma_es": "jffsr.optimizers.evosax_adapter:Evosax",
    "evosax": "jffsr.optimizers.evosax_adapter:Evosax",
}
OPTIMIZERS: dict[str, str] = {
    "qpso": GENERATIONAL["qpso"],
    "hybrid": "jffsr.optimizers.recipes:Hybrid",
    "gradient": "jffsr.optimizers.recipes:Gradient",
    "memetic": "jffsr.optimizers.memetic:Memetic",
    **GENERATIONAL,
}

METHODS = ("lbfgs", "adam")
# Above exp(Euler's constant) a particle's distance from its attractor grows without bound (Sun et al. 2012).
LARGEST_CONTRACTION = math.exp(0.5772156649)


@dataclass(frozen=True)
class Settings:
    """Plain numbers that every registered optimizer is built from; each uses those it knows.

    evaluations: the budget of a population method run alone; swarm_evaluations: the swarm's share in a hybrid;
    gradient_iterations and polish_iterations: steps of the gradient phase on the loosened and on the sharp index,
    each one gradient of every active start; target: stop as soon as the objective is at most this; options: the
    algorithm's own hyperparameters by name.
    """

    particles: int = 50
    evaluations: int = 20_000
    swarm_evaluations: int = 200
    contraction: tuple[float, float] = (1.0, 0.5)
    starts: int = 2
    gradient_iterations: int = 60
    polish_iterations: int = 30
    looseness: float = 10.0
    method: str = "lbfgs"
    learning_rate: float = 0.05
    memory: int = 10
    target: float | None = None
    options: Mapping[str, Option] = field(default_factory=dict)


def algorithm(name: Any, among: Collection[str] = OPTIMIZERS) -> Any:
    """The class of a registered optimizer; InputError names the known ones."""
    if not isinstance(name, str) or name not in among:
        near = hint(name, among) if isinstance(name, str) else ""
        raise InputError(f"optimizer '{name}' is unknown; allowed are {', '.join(among)}{near}")
    module, _, cls = OPTIMIZERS[name].partition(":")
    return getattr(importlib.import_module(module), cls)


def checked_options(name: str, options: Mapping[str, Any]) -> dict[str, Option]:
    """The options as the optimizer wants them; OptionError where it does not take one of them."""
    kind = algorithm(name)
    known = kind.option_fields(options) if hasattr(kind, "option_fields") else option_fields(kind)
    return read_options(known, options)


def build_phases(name: str, settings: Settings) -> list[Phase]:
    """The phases of a registered optimizer; InputError where it is unknown, or its settings do not fit."""
    kind = algorithm(name)
    options = checked_options(name, settings.options)
    if hasattr(kind, "phases"):
        return kind.phases(settings, options)
    return [swarm_phase(name, settings, settings.evaluations, options)]


def swarm_of(options: Mapping[str, Any]) -> type:
    """The population method that the option `swarm` names, by default QPSO; a wrong name is told where it is read."""
    name = options.get("swarm")
    return algorithm(name if isinstance(name, str) and name in GENERATIONAL else "qpso")


def swarm_phase(name: str, settings: Settings, evaluations: int, options: Mapping[str, Any]) -> Phase:
    """A population method of as many whole generations as the evaluations pay for."""
    from jffsr.optimizers.driver import Phase, Stop

    kind, particles = algorithm(name), settings.particles
    start, end = settings.contraction
    if not (0 < start < LARGEST_CONTRACTION and 0 < end < LARGEST_CONTRACTION):
        raise InputError(
            f"contraction {settings.contraction} must lie in (0, {LARGEST_CONTRACTION:.3f}): above, the swarm diverges"
        )
    smallest = _smallest(kind)
    if particles < smallest:
        raise InputError(f"{particles} particles are fewer than the {smallest} that '{name}' needs")
    if evaluations < particles:
        raise InputError(f"{evaluations} evaluations are fewer than one generation of {particles} particles")
    if hasattr(kind, "check"):
        kind.check(options)
    generations = float(evaluations // particles)
    return Phase(
        "swarm",
        built(kind, settings, iterations=generations, **options),
        Stop(iterations=generations, target=target(settings)),
    )


def built(kind: type, settings: Settings, **given: Any) -> Any:
    """A dataclass from what is given, and from the settings where a field has the name of one."""
    start, end = settings.contraction
    values = {**vars(settings), "contraction_start": start, "contraction_end": end, **given}
    return kind(**{f.name: values[f.name] for f in fields(kind) if f.name in values})


def target(settings: Settings) -> float:
    """The value at which a phase ends."""
    return -math.inf if settings.target is None else float(settings.target)


def _smallest(kind: type) -> int:
    """The least number of particles that a population method works with."""
    return next((f.metadata.get("smallest", 1) for f in fields(kind) if f.name == "particles"), 1)
