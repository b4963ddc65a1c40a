"""What sensors, references and controllers hand each other at every sample.

A reference says where the joints should be next, a controller which torques bring them there. Both are given only what
can be measured, and both are pairs of pure functions with a state of their own, so that a whole run is one scan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Quaternion, Scalar, Vector, Vector3


@register_dataclass
@dataclass(frozen=True, eq=False)
class Measured:
    """Sensors at one sample.

    base_quaternion (4,), B to I; base_rate (3,), rad/s, in I (a gyroscope's, turned); base_acceleration (6,), d/dt of
    the base twist in I, m/s^2 and rad/s^2, of the sample before; joint_position (n,) and joint_velocity (n,), rad or m,
    per s; fresh (), bool: false where the measurement was lost and the values are those of the last one.
    """

    base_quaternion: Quaternion
    base_rate: Vector3
    base_acceleration: Array
    joint_position: Vector
    joint_velocity: Vector
    fresh: Scalar


@register_dataclass
@dataclass(frozen=True, eq=False)
class Desired:
    """Joint motion (n,) to follow at a sample: joint_position, joint_velocity, joint_acceleration, rad or m, per s."""

    joint_position: Vector
    joint_velocity: Vector
    joint_acceleration: Vector


class Reference(Protocol):
    """Makes the joint motion to follow, sample by sample."""

    def begin(self, measured: Measured) -> Any:
        """Its state before the first sample."""

    def advance(self, state: Any, time: Scalar, measured: Measured) -> tuple[Any, Desired]:
        """Its next state, and the joint motion for the sample at `time`, s."""


class Controller(Protocol):
    """Makes joint torques, sample by sample."""

    def begin(self, measured: Measured) -> Any:
        """Its state before the first sample."""

    def advance(self, state: Any, time: Scalar, measured: Measured, desired: Desired) -> tuple[Any, Vector]:
        """Its next state, and torques (n,), N m or N, before any limit."""
