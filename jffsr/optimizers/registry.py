"""Optimizers by name: each entry turns a few plain numbers into the phases that the driver runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from jffsr.errors import InputError
from jffsr.optimizers.driver import Phase, Stop
from jffsr.optimizers.gradient import ADAM, LBFGS, GradientDescent
from jffsr.optimizers.qpso import QPSO

# Above exp(Euler's constant) a particle's distance from its attractor grows without bound (Sun et al. 2012).
LARGEST_CONTRACTION = math.exp(0.5772156649)


@dataclass(frozen=True)
class Settings:
    """Plain numbers that every registered optimizer is built from; each uses those it knows.

    evaluations: the budget of a swarm run alone; swarm_evaluations: the swarm's share in a hybrid;
    gradient_iterations: steps of the gradient phase, each one gradient of every active start; target: stop
    as soon as the objective is at most this.
    """

    particles: int = 50
    evaluations: int = 20_000
    swarm_evaluations: int = 200
    contraction: tuple[float, float] = (1.0, 0.5)
    starts: int = 4
    gradient_iterations: int = 60
    method: str = LBFGS
    learning_rate: float = 0.05
    memory: int = 10
    target: float | None = None


def _swarm(settings: Settings, evaluations: int) -> Phase:
    start, end = settings.contraction
    if not (0 < start < LARGEST_CONTRACTION and 0 < end < LARGEST_CONTRACTION):
        raise InputError(
            f"contraction {settings.contraction} must lie in (0, {LARGEST_CONTRACTION:.3f}): above, the swarm diverges"
        )
    if evaluations < settings.particles:
        raise InputError(f"{evaluations} evaluations are fewer than one generation of {settings.particles} particles")
    generations = evaluations // settings.particles - 1
    optimizer = QPSO(
        iterations=float(generations),
        contraction_start=start,
        contraction_end=end,
        particles=settings.particles,
    )
    return Phase("swarm", optimizer, Stop(iterations=float(generations), target=_target(settings)))


def _descent(settings: Settings) -> Phase:
    if settings.method not in (LBFGS, ADAM):
        raise InputError(f"method '{settings.method}' is unknown; allowed are {LBFGS}, {ADAM}")
    optimizer = GradientDescent(
        learning_rate=settings.learning_rate,
        starts=settings.starts,
        method=settings.method,
        memory=settings.memory,
    )
    stop = Stop(iterations=float(settings.gradient_iterations), target=_target(settings))
    return Phase("gradient", optimizer, stop)


def _target(settings: Settings) -> float:
    return -math.inf if settings.target is None else float(settings.target)


def _qpso(settings: Settings) -> list[Phase]:
    return [_swarm(settings, settings.evaluations)]


def _hybrid(settings: Settings) -> list[Phase]:
    return [_swarm(settings, settings.swarm_evaluations), _descent(settings)]


def _gradient(settings: Settings) -> list[Phase]:
    return [_descent(settings)]


OPTIMIZERS: dict[str, Callable[[Settings], list[Phase]]] = {
    "qpso": _qpso,
    "hybrid": _hybrid,
    "gradient": _gradient,
}


def build_phases(name: str, settings: Settings) -> list[Phase]:
    """The phases of a registered optimizer; InputError names the known ones."""
    if name not in OPTIMIZERS:
        raise InputError(f"optimizer '{name}' is unknown; allowed are {', '.join(OPTIMIZERS)}")
    return OPTIMIZERS[name](settings)
