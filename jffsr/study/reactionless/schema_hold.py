"""The section `hold`: how the base is held still after a grasp, by which reference, estimator and controller."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, either, flag, number, sequence, whole

ESTIMATORS = (
    "load_parameters",
    "innovation_forgetting",
    "clock_forgetting",
    "sliding_window",
    "plain",
    "known",
)
CONTROLLERS = ("learnt_load", "passivity_based", "computed_torque", "elm", "pd")
EstimatorName = Annotated[
    Literal[
        "load_parameters",
        "innovation_forgetting",
        "clock_forgetting",
        "sliding_window",
        "plain",
        "known",
    ],
    choice(*ESTIMATORS),
]
ControllerName = Annotated[
    Literal["learnt_load", "passivity_based", "computed_torque", "elm", "pd"], choice(*CONTROLLERS)
]
Axes = Annotated[
    tuple[Annotated[Literal["x", "y", "z"], choice("x", "y", "z")], ...],
    sequence("a list of one to three of x, y, z", 1, 3),
]
Positive = Annotated[float, number(gt=0)]
NotNegative = Annotated[float, number(ge=0)]


Gain = either(
    Annotated[float, number(gt=0, instead=", or a list of them, one for each joint,")],
    Annotated[tuple[Positive, ...], sequence("a positive number or a list of them,", 1, 100)],
    lambda value: isinstance(value, list | tuple),
)


class Sensors(Section):
    """Standard deviations of white noise on each sample."""

    gyro: NotNegative = 0.0  # rad/s
    encoder: NotNegative = 0.0  # rad or m
    rate: NotNegative = 0.0  # rad/s or m/s
    accelerometer: NotNegative = 0.0  # m/s^2 and rad/s^2


class Disturbance(Section):
    """Unknown torque in every joint, N m or N: constant + random u sign(rate), u uniform in [0, 1) at each sample."""

    constant: Annotated[float, number()] = 0.0
    random: NotNegative = 0.0


class Gains(Section):
    """Of r = e_dot + position e: the controller asks for the acceleration rate r; 1/s both, one or one each joint."""

    rate: Gain = 10.0
    position: Gain = 1.0


class Excitation(Section):
    """What moves the null space so that the load can be learnt: sums of sines."""

    units: ClassVar = ("amplitude",)

    amplitude_deg: NotNegative | None = None  # per second
    amplitude: NotNegative | None = None  # rad/s
    slowest: Positive = 0.02  # Hz
    fastest: Positive = 0.15  # Hz

    @model_validator(mode="before")
    @classmethod
    def _default(cls, value):
        if isinstance(value, dict) and all(value.get(k) is None for k in ("amplitude", "amplitude_deg")):
            return {**value, "amplitude": 0.05}
        return value

    @model_validator(mode="after")
    def _check(self) -> Excitation:
        self.check_units()
        if not self.slowest < self.fastest:
            raise conflict(
                f"found {self.slowest:g} Hz, less than the fastest ({self.fastest:g} Hz) is expected",
                "slowest",
            )
        return self


class Ranges(Section):
    """Joints led off the ends of their ranges, in the null space of the base's motion."""

    begin: Annotated[float, number(ge=0, lt=1)] = 0.9  # share of the way from the range's middle to its end
    gain: Positive = 0.2  # 1/s, of the way beyond that place


class Hold(Section):
    """The base held still after the grasp, the target's mass and inertia unknown to reference and controller."""

    duration: Annotated[float, number(gt=0, le=1e4, unit="s")] = 60.0
    rate: Annotated[float, number(gt=0, le=1e4, unit="Hz")] = 100.0
    substeps: Annotated[int, whole(1, 1000)] = 1  # of the plant's integration in a sample
    delay: Annotated[int, whole(0, 1000)] = 0  # samples from a measurement to its torque
    estimator: EstimatorName = "load_parameters"
    controller: ControllerName = "learnt_load"
    gains: Gains = Gains()
    excitation: Excitation = Excitation(amplitude=0.05)
    axes: Axes = (
        "x",
        "y",
        "z",
    )  # of the base that are held; a planar arm can hold only the one it turns about
    attitude_gain: NotNegative = 0.0  # 1/s, back to the attitude at the start
    limits: Annotated[bool, flag()] = True  # the robot's joint rates, accelerations and torques are kept
    ranges: Ranges | None = Ranges()  # null: the joints' position ranges are not looked at
    sensors: Sensors = Sensors()
    disturbance: Disturbance = Disturbance()
    settled: Annotated[float, number(gt=0, unit="s")] = (
        5.0  # the end's stretch in which the base has to be still
    )
    base_rate: Positive = 1e-3  # rad/s, root mean square over that stretch
    seed: Annotated[int, whole(0, 2**32 - 1)] = 0

    @property
    def samples(self) -> int:
        """How many."""
        return int(self.duration * self.rate + 1e-9) + 1

    @model_validator(mode="after")
    def _check(self) -> Hold:
        if len(set(self.axes)) < len(self.axes):
            raise conflict(f"found {list(self.axes)}, each axis once is expected", "axes")
        if self.settled > self.duration:
            raise conflict(
                f"found {self.settled:g} s, at most the duration ({self.duration:g} s) is expected", "settled"
            )
        if self.samples < 2:
            raise conflict(
                f"found {self.duration:g} s, at least one period of the control is expected", "duration"
            )
        return self
