"""The section `constraints`: what the motion has to keep, beside the index; null leaves a constraint out."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import conflict, flag, number
from jffsr.study.schema_task import Quaternion

Flag = Annotated[bool, flag()]
Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]
Angle = Annotated[float, number(ge=-180, le=180, unit="deg", instead=" or null")]
AngleRad = Annotated[float, number(ge=-3.1416, le=3.1416, unit="rad", instead=" or null")]


class FinalAttitude(Section):
    """The base's attitude at the end: a quaternion, or its angle about the inertial z, from the axes of I."""

    units: ClassVar = ("angle",)

    goal: Quaternion | None = None
    angle_deg: Angle | None = None
    angle: AngleRad | None = None
    tolerance: Positive = 1e-8  # rad

    @model_validator(mode="after")
    def _check(self) -> FinalAttitude:
        self.check_units()
        given = self.si("angle") is not None
        if given == (self.goal is not None):
            found = "both 'goal' and an angle are given" if given else "missing"
            raise conflict(
                f"{found}, one of 'goal' (w, x, y, z), 'angle_deg' and 'angle' is expected", "goal"
            )
        return self

    @property
    def quaternion(self) -> tuple[float, ...]:
        """The goal (w, x, y, z), base to inertial frame."""
        if self.goal is not None:
            return self.goal
        half = self.si("angle") / 2
        return (math.cos(half), 0.0, 0.0, math.sin(half))


class JointLimits(Section):
    """Limits of all joints as inequalities, by the peaks over the whole motion."""

    position: Flag = True
    rate: Flag = True
    acceleration: Flag = True
    tolerance: Positive = 1e-3  # relative to the limit

    @model_validator(mode="after")
    def _check(self) -> JointLimits:
        if not (self.position or self.rate or self.acceleration):
            raise conflict("every quantity is switched off, at least one is expected")
        return self

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of those that count."""
        return tuple(name for name in ("position", "rate", "acceleration") if getattr(self, name))


class BaseExcursion(Section):
    """limits.base_excursion as an inequality over the whole motion."""

    tolerance: Positive = 1e-3  # relative to the limit


class TorqueLimit(Section):
    """The torque limits as an inequality at the motion's samples."""

    tolerance: Positive = 1e-3  # relative to the limit


class Clearance(Section):
    """All bodies of the robot that are no neighbours stay `margin`, m, apart at the motion's samples."""

    margin: NotNegative = 0.02
    tolerance: Positive = 1e-4  # m


class Constraints(Section):
    """Equalities and inequalities on the motion."""

    final_attitude: FinalAttitude | None = None
    joint_limits: JointLimits | None = None
    base_excursion: BaseExcursion | None = None
    torque_limit: TorqueLimit | None = None
    clearance: Clearance | None = None
