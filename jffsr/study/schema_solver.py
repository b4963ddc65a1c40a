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


class Trajectory(Section):
    """The joint law and the half width of the box of its free numbers."""

    kind: Annotated[Literal["sine_polynomial"], choice("sine_polynomial")] = "sine_polynomial"
    box: Positive = math.pi


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
