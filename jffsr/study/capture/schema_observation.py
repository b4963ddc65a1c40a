"""The section `observation`: a camera that looks at the target before the robot starts, and what is believed of it."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import conflict, flag, number, whole
from jffsr.study.capture.schema_target import Inertia

Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]
Share = Annotated[float, number(ge=0, lt=1)]


def given_in_degrees(value, quantity: str, degrees: float):
    """The mapping with a quantity that is not given written out in degrees, which people read."""
    if isinstance(value, dict) and value.get(quantity) is None and value.get(f"{quantity}_deg") is None:
        return {**value, f"{quantity}_deg": degrees}
    return value


def grasp_tolerances(value):
    """The mapping with the tolerances of a grasp that have two units written out, each in the one that is usual."""
    value = given_in_degrees(value, "attitude", 2.0)
    no_rate = isinstance(value, dict) and all(
        value.get(key) is None for key in ("angular_velocity", "angular_velocity_deg")
    )
    return {**value, "angular_velocity": 0.01} if no_rate else value


class Camera(Section):
    """A camera's poses of the marker: standard deviations on each axis, and what goes wrong."""

    units: ClassVar = ("attitude_deviation",)

    rate: Annotated[float, number(gt=0, le=1000, unit="Hz")] = 10.0
    position_deviation: Positive = 0.01  # m
    attitude_deviation_deg: Positive | None = None
    attitude_deviation: Positive | None = None
    noise: Positive = 1.0  # times both deviations
    delay: Annotated[float, number(ge=0, le=100, unit="s")] = 0.2
    dropouts: Share = 0.05
    outliers: Share = 0.02
    outlier_factor: Positive = 10.0

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        return given_in_degrees(value, "attitude_deviation", 2.0)

    @model_validator(mode="after")
    def _check(self) -> Camera:
        self.check_units()
        return self


class Prior(Section):
    """What is believed before any pose: inertia, in any unit, in the marker's axes, and neither rate, drift nor offset.

    Standard deviations of each; a truth many of them away makes the filter too sure of itself.
    """

    units: ClassVar = ("angular_velocity_deviation",)

    angular_velocity_deviation_deg: Positive | None = None
    angular_velocity_deviation: Positive | None = None
    inertia: Inertia = (1.0, 1.0, 1.0)
    inertia_deviation: Positive = 0.05  # of the five numbers of the ratios
    velocity_deviation: Positive = 0.05  # m/s
    offset_deviation: Positive = 0.05  # m

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        return given_in_degrees(value, "angular_velocity_deviation", 2.5)

    @model_validator(mode="after")
    def _check(self) -> Prior:
        self.check_units()
        return self


class Convergence(Section):
    """How good the prediction of the grasp has to be, each with the given probability, before anything is planned."""

    units: ClassVar = ("attitude", "angular_velocity")

    required: Annotated[bool, flag()] = True
    position: Positive = 0.01  # m
    attitude_deg: Positive | None = None
    attitude: Positive | None = None
    linear_velocity: Positive = 0.01  # m/s
    angular_velocity_deg: Positive | None = None
    angular_velocity: Positive | None = None
    confidence: Annotated[float, number(gt=0, lt=1)] = 0.99

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        return grasp_tolerances(value)

    @model_validator(mode="after")
    def _check(self) -> Convergence:
        self.check_units()
        return self


class Observation(Section):
    """The target is observed for `duration`, s, before the robot starts, and planned for as it is predicted."""

    duration: Annotated[float, number(gt=0, le=1e4, unit="s")] = 30.0
    camera: Camera = Camera(attitude_deviation_deg=2.0)
    prior: Prior = Prior(angular_velocity_deviation_deg=2.5)
    acquisition: Annotated[int, whole(2, 10_000)] = 100  # first poses that are fitted together
    convergence: Convergence = Convergence(attitude_deg=2.0, angular_velocity=0.01)
    seed: Annotated[int, whole(0, 2**32 - 1)] = 0

    @property
    def poses(self) -> int:
        """How many times the camera looks."""
        return int(self.duration * self.camera.rate + 1e-9) + 1

    @model_validator(mode="after")
    def _check(self) -> Observation:
        if self.poses <= self.acquisition:
            sentence = (
                f"found {self.duration:g} s, in which {self.poses} poses are measured; more than the acquisition's "
                f"{self.acquisition} are expected"
            )
            raise conflict(sentence, "duration")
        return self
