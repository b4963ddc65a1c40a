"""Computed torque with the model of the robot without its load, the free base eliminated."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp

from jffsr.dynamics.equations_of_motion import inverse_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.errors import Gains, tracking_errors
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.types import Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class ComputedTorque:
    """tau = H*(q) a + c* with a = qdd_d + K r + Lambda e_dot: linear error dynamics where the model is exact.

    The robot is the one without load. The base's attitude and angular velocity are measured; its linear velocity is
    not, and does not matter: by Galileo's principle no torque depends on it.
    """

    robot: Robot
    gains: Gains

    @classmethod
    def of(cls, robot: Robot, gains: Gains | None = None) -> ComputedTorque:
        """For the robot without load; the published gains by default."""
        return cls(robot, Gains.fitting(robot, gains))

    def begin(self, measured: Measured) -> tuple:
        """It has no state."""
        return ()

    def advance(
        self, state: tuple, time: Scalar, measured: Measured, desired: Desired
    ) -> tuple[tuple, Vector]:
        """The torques (n,)."""
        errors = tracking_errors(measured, desired, self.gains.slope)
        wanted = (
            desired.joint_acceleration
            + self.gains.rate * errors.combined
            + self.gains.slope * errors.error_rate
        )
        kin = kinematics(self.robot, State(jnp.zeros(3), measured.base_quaternion, errors.position))
        twist = jnp.concatenate([jnp.zeros(3), measured.base_rate])
        torque, _ = inverse_dynamics(self.robot, kin, twist, errors.velocity, wanted)
        return state, torque
