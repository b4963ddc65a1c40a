"""What a sampled control loop is run under: clock, delay, limits, sensors, and what disturbs it."""

from __future__ import annotations

from dataclasses import dataclass, field
from numbers import Integral, Real

import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class Sensors:
    """Standard deviations of white noise on every sample, and when nothing is measured.

    gyro, rad/s, on each component of the base's angular velocity; encoder, rad or m, and rate, rad/s or m/s, on the
    joints; accelerometer, m/s^2 and rad/s^2, on the base's acceleration, which is the mean over the last period. The
    base's attitude is without noise. From lost_from to lost_until, s, measurements are lost.
    """

    gyro: Array | float = 0.0
    encoder: Array | float = 0.0
    rate: Array | float = 0.0
    accelerometer: Array | float = 0.0
    lost_from: Array | float = np.inf
    lost_until: Array | float = np.inf

    def __post_init__(self) -> None:
        for name in ("gyro", "encoder", "rate", "accelerometer"):
            value = getattr(self, name)
            if isinstance(value, Real) and not (np.isfinite(value) and value >= 0):
                raise InputError(f"{name} is {value!r}; a standard deviation of at least 0 is expected")


@register_dataclass
@dataclass(frozen=True)
class JointDisturbance:
    """Unknown torque in every joint, N m or N: constant + random u sign(qd), u uniform in [0, 1), drawn each sample.

    Ye, Dong and Hong 2019, section 4.1, has constant 0.5 and random 1; with M qdd + C qd = tau + d it pushes along the
    motion. It acts between two bodies, so that the momentum of the whole stays. It is held over the sample.
    """

    constant: Array | float = 0.0
    random: Array | float = 0.0

    @classmethod
    def published(cls) -> JointDisturbance:
        """0.5 + rand(0, 1) sign(qd)."""
        return cls(0.5, 1.0)


@register_dataclass
@dataclass(frozen=True)
class Strike:
    """A wrench (6,), [force, N; moment, N m, about the tool], in the axes of the tool, from `time` for `duration`, s.

    It acts from outside: the momentum of the whole changes by its impulse, whatever the step.
    """

    wrench: Array
    time: Array | float
    duration: Array | float = 0.01

    def __post_init__(self) -> None:
        _positive("duration of a strike", self.duration)


@register_dataclass
@dataclass(frozen=True)
class Bounds:
    """Beyond what a run is said to have failed.

    joint_rate, rad/s or m/s, and base_rate, rad/s; saturation, s, that a joint may be at its torque limit without a
    break; error, rad or m, of any joint in the last tenth of the run.
    """

    joint_rate: Array | float = 10.0
    base_rate: Array | float = 1.0
    saturation: Array | float = 1.0
    error: Array | float = 0.1


@register_dataclass
@dataclass(frozen=True)
class LoopSettings:
    """A sampled loop: `samples` of a control period, s, each with `substeps` integration steps of the plant.

    A torque asked for at a sample acts `delay` samples later, none before; it is cut to torque_limit (n,) or one number
    for all, N m or N, and held over the period. samples, substeps and delay are static. Raises InputError for numbers
    that make no sense.
    """

    samples: int = field(metadata={"static": True})
    period: Array | float = 0.01
    substeps: int = field(default=1, metadata={"static": True})
    delay: int = field(default=0, metadata={"static": True})
    torque_limit: Array | float = np.inf
    sensors: Sensors = field(default_factory=Sensors)
    disturbance: JointDisturbance = field(default_factory=JointDisturbance)
    strike: Strike | None = None
    bounds: Bounds = field(default_factory=Bounds)

    def __post_init__(self) -> None:
        for name, least in (("samples", 2), ("substeps", 1), ("delay", 0)):
            value = getattr(self, name)
            if not isinstance(value, Integral) or isinstance(value, bool) or value < least:
                raise InputError(f"{name} is {value!r}; a whole number of at least {least} is expected")
        _positive("period", self.period)
        limit = self.torque_limit
        if isinstance(limit, Real | np.ndarray) and not np.all(np.asarray(limit) > 0):
            raise InputError(f"torque_limit is {limit}; positive numbers are expected")


def check_loop(robot: Robot, initial_state: State, settings: LoopSettings) -> None:
    """InputError where a state, a torque limit or a stroke is not of this robot's size; shapes alone are looked at."""
    n = robot.num_joints
    found = np.shape(initial_state.joint_position)
    if found != (n,):
        raise InputError(
            f"initial_state has joint_position of shape {found}; robot '{robot.name}' has {n} joints"
        )
    found = np.shape(settings.torque_limit)
    if found not in ((), (n,)):
        raise InputError(
            f"torque_limit has shape {found}; one number, or one for each of {n} joints, is expected"
        )
    if settings.strike is not None:
        found = np.shape(settings.strike.wrench)
        if found != (6,):
            raise InputError(f"a strike's wrench has shape {found}; force and moment, (6,), are expected")
        robot.end_effector_index(None)


def _positive(name: str, value: object) -> None:
    # Numbers of the host alone: traced ones, and what JAX puts in place of them, pass.
    if isinstance(value, Real) and not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} is {value!r} s; a positive time is expected")
