"""Computed torque with a load that is learnt on the way."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.control.computed_torque import ComputedTorque
from jffsr.reactionless.control.errors import Gains
from jffsr.reactionless.estimation.balance import balance_of
from jffsr.reactionless.estimation.parameters import LoadEstimate, LoadParameters
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.composing.composition import weld
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Robot
from jffsr.types import Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class LearntLoad:
    """`ComputedTorque` of the robot with the load that `model` estimates at the sample: certainty equivalence.

    robot: the one without load. The momentum balance cannot tell loads with the same reduced mass and moments apart,
    but these give the same torques too, while the system's centre of mass is not accelerated. end_effector, static:
    what carries the load, None the first.
    """

    robot: Robot
    gains: Gains
    model: LoadParameters
    end_effector: str | None = field(default=None, metadata={"static": True})

    @classmethod
    def of(
        cls,
        robot: Robot,
        gains: Gains | None = None,
        model: LoadParameters | None = None,
        end_effector: str | None = None,
    ) -> LearntLoad:
        """For the robot without load; the published gains and the estimator's own settings by default."""
        gains = Gains.published(robot.num_joints) if gains is None else gains
        return cls(robot, gains, LoadParameters() if model is None else model, end_effector)

    def begin(self, measured: Measured) -> LoadEstimate:
        """The load as first guessed."""
        return self.model.begin(balance_of(self.robot, measured, self.end_effector))

    def advance(
        self, state: LoadEstimate, time: Scalar, measured: Measured, desired: Desired
    ) -> tuple[LoadEstimate, Vector]:
        """The next estimate of the load, and torques (n,)."""
        state = self.model.update(state, balance_of(self.robot, measured, self.end_effector))
        load = state.load
        body = RigidBody(load.mass, jnp.zeros(3), load.inertia)
        whole = weld(self.robot, body, end_effector=self.end_effector, position=load.com)
        _, torque = ComputedTorque(whole, self.gains).advance((), time, measured, desired)
        return state, torque
