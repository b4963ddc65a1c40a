"""The sections that say how a plan is searched, checked and shown."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import BASE_MODES, FLOATING
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, number, sequence, whole
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
    """The search; a swarm, gradients from several starts, or gradients from the best of a swarm."""

    kind: Annotated[Literal["qpso", "hybrid", "gradient"], choice("qpso", "hybrid", "gradient")] = "hybrid"
    particles: Annotated[int, whole(2, 100_000)] = 50
    evaluations: Annotated[int, whole(1, 10**9)] = 20_000  # qpso: the whole budget
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

    @model_validator(mode="after")
    def _check(self) -> Optimizer:
        for kind, budget in (("hybrid", "swarm_evaluations"), ("qpso", "evaluations")):
            value = getattr(self, budget)
            if self.kind == kind and value < self.particles:
                sentence = (
                    f"found {value}, at least one for each of the {self.particles} particles is expected"
                )
                raise conflict(sentence, budget)
        if self.kind == "hybrid" and self.starts > self.particles:
            sentence = f"found {self.starts}, at most the number of particles ({self.particles}) is expected"
            raise conflict(sentence, "starts")
        return self


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
