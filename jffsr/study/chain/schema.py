"""The typed configuration of a chain: that of a capture from a camera's poses, and what follows the plan."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import FLOATING
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, number, whole
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.capture.schema_observation import grasp_tolerances
from jffsr.study.reactionless.schema_hold import Hold

Positive = Annotated[float, number(gt=0)]


class Approach(Section):
    """The plan driven in MuJoCo by torques, beside the true target and with contacts on."""

    step: Annotated[float, number(gt=0, le=0.1, unit="s")] = 2e-3
    samples: Annotated[int, whole(2, 10_000)] = 200  # that are recorded


class GraspTolerance(Section):
    """How far from the true grasp frame the tool may be at the grasp."""

    units: ClassVar = ("attitude", "angular_velocity")

    position: Positive = 0.01  # m
    attitude_deg: Positive | None = None
    attitude: Positive | None = None
    linear_velocity: Positive = 0.01  # m/s
    angular_velocity_deg: Positive | None = None
    angular_velocity: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        return grasp_tolerances(value)

    @model_validator(mode="after")
    def _check(self) -> GraspTolerance:
        self.check_units()
        return self

    @property
    def sizes(self) -> tuple[float, float, float, float]:
        """Of position, m, attitude, rad, velocity, m/s, and angular velocity, rad/s."""
        return self.position, self.si("attitude"), self.linear_velocity, self.si("angular_velocity")


class ChainConfig(CaptureConfig):
    """A capture from what a camera sees to a base that is held still with the target in hand.

    The target's inertia is in kg m^2 here, for it is grasped.
    """

    kind: Annotated[Literal["chain"], choice("chain")]
    approach: Approach = Approach()
    grasp_tolerance: GraspTolerance = GraspTolerance(attitude_deg=2.0, angular_velocity=0.01)
    hold: Hold = Hold()

    @model_validator(mode="after")
    def _check_chain(self) -> ChainConfig:
        if self.observation is None:
            raise conflict(
                "is missing, a chain begins with a camera; give the section, empty for its defaults",
                "observation",
            )
        if self.front is not None:
            raise conflict("a chain carries out one plan, leave it out or set it to null", "front")
        if self.task.base_mode != FLOATING:
            raise conflict(f"found '{self.task.base_mode}', a chain's base floats", "task.base_mode")
        if not self.target.has_solids:
            raise conflict("found no shape that can be touched, at least one is expected", "target.shapes")
        return self
