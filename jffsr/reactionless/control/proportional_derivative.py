"""Feedback of position and rate, joint by joint."""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.errors import Gains, decoupled_inertia, tracking_errors
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class ProportionalDerivative:
    """tau = M K r with r = e_dot + Lambda e and e = q_d - q: the PD part of Ye, Dong and Hong 2019, equation (47).

    Its sign is that of M qdd + C qd = tau + d; printed is the other. inertia (n,) is M_ii.
    """

    inertia: Array
    gains: Gains

    @classmethod
    def of(cls, robot: Robot, joint_position: Vector, gains: Gains | None = None) -> ProportionalDerivative:
        """For the robot without load about a posture; the published gains by default."""
        gains = Gains.fitting(robot, gains)
        return cls(decoupled_inertia(robot, joint_position), gains)

    def begin(self, measured: Measured) -> tuple:
        """It has no state."""
        return ()

    def advance(
        self, state: tuple, time: Scalar, measured: Measured, desired: Desired
    ) -> tuple[tuple, Vector]:
        """The torques (n,)."""
        r = tracking_errors(measured, desired, self.gains.slope).combined
        return state, self.inertia * self.gains.rate * r
