"""A joint motion that was planned ahead, as a reference."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.interface import Desired, Measured
from jffsr.trajectories.interface import Trajectory
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class Recorded:
    """Joint position, velocity and acceleration (N, n) at N samples, played in order, the last then held."""

    joint_position: Array
    joint_velocity: Array
    joint_acceleration: Array

    @classmethod
    def of(cls, trajectory: Trajectory, samples: int, period: float) -> Recorded:
        """A trajectory at `samples` times, `period`, s, apart."""
        times = jnp.arange(samples) * period
        return cls(*jax.vmap(lambda t: trajectory(t))(times))

    def begin(self, measured: Measured) -> Array:
        """The number of the next sample."""
        return jnp.zeros((), dtype=int)

    def advance(self, state: Array, time: Scalar, measured: Measured) -> tuple[Array, Desired]:
        """The sample's motion; beyond the last it stands still there."""
        last = self.joint_position.shape[0] - 1
        moving = state <= last
        index = jnp.minimum(state, last)
        motion = (self.joint_position, self.joint_velocity, self.joint_acceleration)
        position, velocity, acceleration = (jnp.asarray(x)[index] for x in motion)
        still = jnp.zeros_like(velocity)
        desired = Desired(
            position, jnp.where(moving, velocity, still), jnp.where(moving, acceleration, still)
        )
        return state + 1, desired
