"""One step of a motion under forces: what all torque-driven motions share."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_multiply
from jffsr.types import Scalar, Vector

_REACH = np.array([0.0, 0.5, 0.5, 1.0])
_WEIGHT = np.array([1.0, 2.0, 2.0, 1.0]) / 6


def state_slope(state: State, acceleration: Vector) -> State:
    """Derivative of a state, in place of each of its numbers, where accelerations (6 + n,) are as
    `jffsr.forward_dynamics` gives them."""
    spin = jnp.concatenate([jnp.zeros(1), state.base_twist[3:]])
    return State(
        base_position=state.base_twist[:3],
        base_quaternion=0.5 * quaternion_multiply(spin, state.base_quaternion),
        joint_position=state.joint_velocity,
        base_twist=acceleration[:6],
        joint_velocity=acceleration[6:],
    )


def runge_kutta_step(
    slope: Callable[[Scalar, State], State], state: State, time: Scalar, step: Scalar
) -> State:
    """The state a step, s, later, by the classical method of order 4; the quaternion is brought back to unit length."""

    # The four stages are one loop, so that the dynamics is compiled once.
    def stage(carry, inputs):
        last, total = carry
        reach, weight = inputs
        reached = jax.tree.map(lambda x, k: x + reach * step * k, state, last)
        k = slope(time + reach * step, reached)
        return (k, jax.tree.map(lambda sum_, new: sum_ + weight * new, total, k)), None

    zero = jax.tree.map(jnp.zeros_like, state)
    (_, total), _ = jax.lax.scan(stage, (zero, zero), (_REACH, _WEIGHT))
    following = jax.tree.map(lambda x, k: x + step * k, state, total)
    quaternion = following.base_quaternion / jnp.linalg.norm(following.base_quaternion)
    return State(
        following.base_position,
        quaternion,
        following.joint_position,
        following.base_twist,
        following.joint_velocity,
    )


def filled_state(state: State, num_joints: int) -> State:
    """The state with its velocities filled in, all floating point."""
    twist, rate = state.base_twist, state.joint_velocity
    return State(
        base_position=jnp.asarray(state.base_position, dtype=float),
        base_quaternion=jnp.asarray(state.base_quaternion, dtype=float),
        joint_position=jnp.asarray(state.joint_position, dtype=float),
        base_twist=jnp.zeros(6) if twist is None else jnp.asarray(twist, dtype=float),
        joint_velocity=jnp.zeros(num_joints) if rate is None else jnp.asarray(rate, dtype=float),
    )
