"""The sections that say how a plan is searched, checked and shown."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Annotated, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import BASE_MODES, FLOATING
from jffsr.errors import InputError
from jffsr.optimizers.hyperparameters import OptionError
from jffsr.optimizers.registry import OPTIMIZERS, Settings, build_phases
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, mapping, number, sequence, whole
from jffsr.rollouts.kernels import FAST, KERNELS

Positive = Annotated[float, number(gt=0)]
Flag = Annotated[bool, flag()]
# Above 1.781 (e to Euler's constant) a particle drawn by QPSO wanders off instead of settling.
Coefficient = Annotated[float, number(gt=0, lt=1.781)]
Contraction = Annotated[tuple[Coefficient, ...], sequence("a pair of numbers in (0, 1.781)", 2, 2)]


SINE_POLYNOMIAL, POLYNOMIAL, BSPLINE = "sine_polynomial", "polynomial", "bspline"
_OF_LAW = {  # the keys that each joint law knows, with their defaults
    SINE_POLYNOMIAL: {"box": math.pi},
    POLYNOMIAL: {"degree": 7, "box": 2.0},
    BSPLINE: {"degree": 4, "control_points": 8, "box": 2.0},
}


class Trajectory(Section):
    """The joint law, its size, and the half width of the box of its free numbers; null is the law's own default."""

    kind: Annotated[
        Literal["sine_polynomial", "polynomial", "bspline"], choice(SINE_POLYNOMIAL, POLYNOMIAL, BSPLINE)
    ] = SINE_POLYNOMIAL
    degree: Annotated[int, whole(3, 20)] | None = None  # polynomial: 6 to 20; bspline: 3 to 20
    control_points: Annotated[int, whole(7, 100)] | None = None  # bspline: those at the ends count
    box: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        # Written out, so that a resolved configuration shows what the law uses.
        own = _OF_LAW.get(value.get("kind", SINE_POLYNOMIAL), {}) if _is_plain(value) else {}
        missing = {key: default for key, default in own.items() if value.get(key) is None}
        return {**value, **missing} if own else value

    @model_validator(mode="after")
    def _check(self) -> Trajectory:
        for key in ("degree", "control_points"):
            if getattr(self, key) is not None and key not in _OF_LAW[self.kind]:
                sentence = (
                    f"found {getattr(self, key)}, the law '{self.kind}' has no such number, leave it out"
                )
                raise conflict(sentence, key)
        if self.kind == POLYNOMIAL and self.degree < 6:
            sentence = f"found {self.degree}, a polynomial with free numbers has a degree of at least 6"
            raise conflict(sentence, "degree")
        if self.kind == BSPLINE and self.control_points <= self.degree:
            sentence = f"found {self.control_points}, more than the degree ({self.degree}) are expected"
            raise conflict(sentence, "control_points")
        return self

    @property
    def keeps_position(self) -> bool:
        """Whether finite position limits hold by the law's construction."""
        return self.kind != POLYNOMIAL


def _is_plain(value) -> bool:
    return isinstance(value, dict) and isinstance(value.get("kind", SINE_POLYNOMIAL), str)


class Rollout(Section):
    """Steps of the base motion's integration, how the base is held meanwhile, and which code finds the inertias."""

    num_steps: Annotated[int, whole(4, 100_000)] = 100
    base_mode: Annotated[Literal["floating", "attitude_held", "fixed"], choice(*BASE_MODES)] = FLOATING
    kernel: Annotated[Literal["fast", "plain"], choice(*KERNELS)] = FAST


class Optimizer(Section):
    """The search: a population method, gradients from several starts, or gradients from the best of a swarm."""

    kind: Annotated[str, choice(*OPTIMIZERS)] = "hybrid"
    particles: Annotated[int, whole(2, 100_000)] = 50
    evaluations: Annotated[int, whole(1, 10**9)] = 20_000  # all but hybrid and gradient: the whole budget
    swarm_evaluations: Annotated[int, whole(1, 10**9)] = 200  # hybrid: budget of the swarm phase
    contraction: Contraction = (1.0, 0.5)  # contraction-expansion coefficient: from, to
    starts: Annotated[int, whole(1, 10_000)] = 2  # gradient: starts; hybrid: best particles refined
    gradient_iterations: Annotated[int, whole(0, 10**6)] = 60  # on the loosened index
    polish_iterations: Annotated[int, whole(0, 10**6)] = 30  # on the sharp one
    looseness: Annotated[float, number(ge=1, le=1000)] = 10.0  # how much rounder the loosened index is
    method: Annotated[Literal["lbfgs", "adam"], choice("lbfgs", "adam")] = "lbfgs"
    learning_rate: Positive = 0.05  # adam
    memory: Annotated[int, whole(1, 1000)] = 10  # lbfgs
    target: Annotated[float, number(ge=0, instead=" or null")] | None = None
    chunk: Annotated[int, whole(1, 10**6)] = 10  # iterations between two looks of the host
    options: Annotated[dict[str, float | int | str | bool], mapping("options of the optimizer")] = {}  # noqa: RUF012

    @model_validator(mode="after")
    def _check(self) -> Optimizer:
        budget = "swarm_evaluations" if self.kind == "hybrid" else "evaluations"
        value = getattr(self, budget)
        if self.kind != "gradient" and value < self.particles:
            sentence = f"found {value}, at least one for each of the {self.particles} particles is expected"
            raise conflict(sentence, budget)
        if self.kind == "hybrid" and self.starts > self.particles:
            sentence = f"found {self.starts}, at most the number of particles ({self.particles}) is expected"
            raise conflict(sentence, "starts")
        if self.options or self.kind not in ("qpso", "hybrid", "gradient"):
            # These know best what they take; the others need not be loaded to tell.
            try:
                build_phases(self.kind, self.settings())
            except OptionError as error:
                raise conflict(error.sentence, f"options.{error.option}") from None
            except InputError as error:
                raise conflict(str(error), "particles" if "particles" in str(error) else "kind") from None
        return self

    def settings(self) -> Settings:
        """The same as the registry wants it."""
        return Settings(**{f.name: getattr(self, f.name) for f in fields(Settings)})


Deviation = Annotated[float, number(ge=0, le=0.5)]


class Robust(Section):
    """Planning against errors in the robot's numbers: relative standard deviations, and what counts of the index.

    With samples at 0 the robot is taken to be what its file says.
    """

    samples: Annotated[int, whole(0, 100_000)] = 0
    measure: Annotated[
        Literal["expected", "worst_case", "cvar"], choice("expected", "worst_case", "cvar")
    ] = "cvar"
    level: Annotated[float, number(ge=0, le=1)] = 0.9  # cvar: the mean of the worst 1 - level
    mass: Deviation = 0.05
    inertia: Deviation = 0.05
    length: Deviation = 0.01
    width: Positive = 0.05  # of the rounding for gradients, in units of the index
    seed: Annotated[int, whole(0, 2**32 - 2)] = 0

    @property
    def deviations(self) -> dict[str, float]:
        """Those of `jffsr.perturbed`."""
        return {"mass": self.mass, "inertia": self.inertia, "length": self.length}


class Verification(Section):
    """The finer re-run of a finished plan and what it must keep."""

    step_factor: Annotated[int, whole(2, 1000)] = 4
    limit_tolerance: Positive = 1e-3
    attitude_tolerance: Positive = 1e-6
    momentum_tolerance: Positive = 1e-6
    sensitivity: Flag = True  # derivatives of the plan by every mass and inertia


class Output(Section):
    """What is shown and drawn."""

    figures: Flag = True
    progress: Flag = True
