"""The section `objective`: named terms, each |value|/scale, and the user's own."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, flag, number, sequence, text

Positive = Annotated[float, number(gt=0)]
Flag = Annotated[bool, flag()]
FlagOrNull = Annotated[bool, flag()] | None

TERMS = (
    "attitude_change",
    "joint_position",
    "joint_rate",
    "joint_acceleration",
    "joint_torque",
    "attitude_excursion",
    "goal_attitude",
    "tool_position",
    "torque_integral",
    "torque_energy",
    "mechanical_work",
    "peak_torque",
    "attitude_penalty",
)
EFFORTS = ("torque_integral", "torque_energy", "mechanical_work", "peak_torque")
"""Terms that a torque limit comes with."""


class AttitudeChange(Section):
    """Turn of the base from start to end; enabled null: on unless a goal attitude is given."""

    units: ClassVar = ("scale",)

    scale_deg: Positive | None = None
    scale: Positive | None = None
    enabled: FlagOrNull = None

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        # The default is written out, so that a resolved configuration shows it in the unit that people read.
        if isinstance(value, dict) and value.get("scale") is None and value.get("scale_deg") is None:
            return {**value, "scale_deg": 0.1}
        return value

    @model_validator(mode="after")
    def _check(self) -> AttitudeChange:
        self.check_units()
        return self

    @property
    def scale_si(self) -> float:
        """The turn that counts 1, rad."""
        return self.si("scale")


class Overrun(Section):
    """Relative overrun of a limit, summed over joints or axes."""

    scale: Positive = 0.01
    enabled: Flag = True


class PositionOverrun(Section):
    """Relative overrun of the position limits; enabled null: on for joint laws that do not keep them themselves."""

    scale: Positive = 0.01
    enabled: FlagOrNull = None


class TorqueOverrun(Section):
    """Relative overrun of the torque limits; enabled null: on beside an effort, or where limits.torque is given."""

    scale: Positive = 0.01
    enabled: FlagOrNull = None


class Effort(Section):
    """A measure of the torques, off by default: their integral, N m s, their energy, N^2 m^2 s, work, J, peak, N m."""

    scale: Positive = 1.0
    enabled: Flag = False


class AttitudePenalty(Section):
    """Squared angle from the base's final attitude to its goal (its start without one), rad^2; alpha is 1/scale."""

    scale: Positive = 1e-6
    enabled: Flag = False


class GoalAttitude(Section):
    """Final attitude error, the sine of half its angle; enabled null: on when a goal attitude is given."""

    scale: Positive = 0.001
    enabled: FlagOrNull = None


class ToolPosition(Section):
    """Final position error of the tool, m."""

    scale: Positive = 0.001
    enabled: Flag = False


class OwnTerm(Section):
    """A term of the user's own: a callable by its dotted name."""

    call: Annotated[str, text(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)+", "a dotted name such as my_package.my_term")]
    weight: Annotated[float, number(ge=0)] = 1.0
    name: Annotated[str, text(r"[A-Za-z_]\w*", "a name of letters, digits and '_', or null,")] | None = None

    @property
    def label(self) -> str:
        """The name in every result: `name`, else the callable's own."""
        return self.name or self.call.rpartition(".")[2]


class Smoothing(Section):
    """Widths of the smooth stand-ins for norm, peak and overrun that gradients are taken of."""

    norm: Positive = 0.5  # of the term's scale
    peak: Positive = 0.002  # of the limit
    overrun: Positive = 0.002  # of the limit


class Objective(Section):
    """The composite index."""

    attitude_measure: Annotated[
        Literal["rotation_vector", "euler_zxy"], choice("rotation_vector", "euler_zxy")
    ] = "rotation_vector"
    attitude_change: AttitudeChange = Field(default_factory=lambda: AttitudeChange(scale_deg=0.1))
    joint_position: PositionOverrun = PositionOverrun()
    joint_rate: Overrun = Overrun()
    joint_acceleration: Overrun = Overrun()
    joint_torque: TorqueOverrun = TorqueOverrun()
    attitude_excursion: Overrun = Overrun()
    goal_attitude: GoalAttitude = GoalAttitude()
    tool_position: ToolPosition = ToolPosition()
    torque_integral: Effort = Effort()
    torque_energy: Effort = Effort()
    mechanical_work: Effort = Effort()
    peak_torque: Effort = Effort()
    attitude_penalty: AttitudePenalty = AttitudePenalty()
    terms: Annotated[tuple[OwnTerm, ...], sequence("a list of at most 100 terms {call: ...}", 0, 100)] = ()
    smoothing: Smoothing = Smoothing()
    accuracy: Annotated[float, number(ge=0)] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Objective:
        taken = set(TERMS)
        for i, term in enumerate(self.terms):
            if term.label in taken:
                sentence = f"a second term is named '{term.label}', give each its own 'name'"
                raise conflict(sentence, f"terms.{i}")
            taken.add(term.label)
        return self
