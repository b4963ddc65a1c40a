"""A reactionless reference for a compound that is known: what the controllers' comparison follows."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.dynamics.momentum import inertia_blocks
from jffsr.reactionless.interface import Desired, Measured
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import skew
from jffsr.types import Array, Scalar, Vector

_CUT = 1e-10


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class KnownCompound:
    """Minimum-norm rates that take up the momentum, plus a null-space part: Ye, Dong and Hong 2019, equation (19).

    robot is the compound with its true load; momentum (3,), L about the centre of mass in I, N m s; null_rate (n,) is
    zeta, rad/s, turned as cos(swing t); period, s. The base is taken to stand still, as it would: only its attitude at
    the start counts.
    """

    robot: Robot
    momentum: Array
    null_rate: Array
    swing: Array | float
    period: Array | float

    def begin(self, measured: Measured) -> tuple[Array, Array]:
        """The base's attitude (4,) to keep, and joint positions (n,)."""
        return measured.base_quaternion, measured.joint_position

    def advance(
        self, state: tuple[Array, Array], time: Scalar, measured: Measured
    ) -> tuple[tuple[Array, Array], Desired]:
        """One period further by Runge-Kutta, with the acceleration as the rates' derivative along the motion."""
        quaternion, position = state

        def rates(time: Scalar, position: Vector) -> Vector:
            return self.rates(quaternion, position, time)

        step = self.period
        k1 = rates(time, position)
        k2 = rates(time + step / 2, position + step / 2 * k1)
        k3 = rates(time + step / 2, position + step / 2 * k2)
        k4 = rates(time + step, position + step * k3)
        following = position + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        _, acceleration = jax.jvp(rates, (time, position), (jnp.ones_like(time), k1))
        return (quaternion, following), Desired(position, k1, acceleration)

    def rates(self, quaternion: Array, position: Vector, time: Scalar) -> Vector:
        """Joint rates (n,) that leave the base's attitude alone, equation (19) with r_g x P left out of L."""
        kin = kinematics(self.robot, State(jnp.zeros(3), quaternion, position))
        _, h_bm, _ = inertia_blocks(self.robot, kin)
        lever = system_com(self.robot, kin) - kin.base_position
        # About the common centre of mass, where linear momentum does not enter.
        coupling = h_bm[3:] - skew(lever) @ h_bm[:3]
        inverse = jnp.linalg.pinv(coupling, rtol=_CUT)
        free = self.null_rate * jnp.cos(self.swing * time)
        return inverse @ self.momentum + free - inverse @ (coupling @ free)
