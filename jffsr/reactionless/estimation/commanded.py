"""Commanded rates put through the momentum equation: a robot whose joints do at once as they are told.

What a reference can do at best, without a controller's share in the error: the base turns as momentum is conserved with
the true load, and the reference sees the base's rate and the joints through noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.estimation.balance import Load, balance_of, load_blocks
from jffsr.reactionless.interface import Measured, Reference
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import (
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from jffsr.types import Array, Quaternion, Scalar, Vector, Vector3


@register_dataclass
@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations: base_rate, rad/s; joint_position, rad or m; joint_rate, rad/s or m/s."""

    base_rate: Array | float = 0.0
    joint_position: Array | float = 0.0
    joint_rate: Array | float = 0.0


@register_dataclass
@dataclass(frozen=True, eq=False)
class LoadHistory:
    """Two loads in the tool frame, the second from time `change`, s, on; angular_momentum (3,), N m s, in I, of
    robot and first load.

    The second one docks without a jolt: velocities go on, and the momentum is that of the new whole.
    """

    first: Load
    second: Load
    change: Array | float
    angular_momentum: Vector3


@register_dataclass
@dataclass(frozen=True, eq=False)
class CommandedRun:
    """N samples: time (N,), s; base_rate (N, 3), rad/s, in B, at the end of each sample; base_quaternion (N, 4) there;
    joint_position and joint_velocity (N, n); states: the reference's, with a leading axis."""

    time: Array
    base_rate: Array
    base_quaternion: Array
    joint_position: Array
    joint_velocity: Array
    states: Any


def commanded_run(
    robot: Robot,
    history: LoadHistory,
    reference: Reference,
    joint_position: Vector,
    joint_velocity: Vector,
    period: Array | float,
    num_samples: int,
    noise: SensorNoise | None = None,
    key: Array | None = None,
    lost: Array | None = None,
    end_effector: str | None = None,
) -> CommandedRun:
    """`num_samples` (static) samples of `period`, s, from joints (n,) and their rates (n,), the base upright in I.

    noise, drawn with the key; lost (num_samples,), bool: where no measurement arrives, and the last goes on.
    """
    noise = SensorNoise() if noise is None else noise
    keys = jax.random.split(jax.random.PRNGKey(0) if key is None else key, num_samples)
    lost = jnp.zeros(num_samples, dtype=bool) if lost is None else jnp.asarray(lost)
    upright = jnp.array([1.0, 0.0, 0.0, 0.0])

    def blocks(q: Vector, changed: Scalar) -> tuple[Array, Array]:
        """H_w (3, 3) and H_wphi (3, n) of robot and load, in B."""
        zeros = jnp.zeros_like(q)
        still = Measured(upright, jnp.zeros(3), jnp.zeros(6), q, zeros, jnp.array(True))
        balance = balance_of(robot, still, end_effector)
        load = jax.tree.map(lambda a, b: jnp.where(changed, b, a), history.first, history.second)
        locked, coupling = load_blocks(balance, load)
        return balance.locked + locked, balance.coupling + coupling

    def rate_of(quaternion: Quaternion, at: tuple[Array, Array], rates: Vector, momentum: Vector3) -> Vector3:
        locked, coupling = at
        turned = quaternion_to_matrix(quaternion).T @ momentum
        return jnp.linalg.solve(locked, turned - coupling @ rates)

    def measure(quaternion, q, rates, rate, key, fresh, last: Measured) -> Measured:
        a, b, c = jax.random.split(key, 3)
        seen = rate + noise.base_rate * jax.random.normal(a, (3,))
        new = Measured(
            quaternion,
            quaternion_to_matrix(quaternion) @ seen,
            jnp.zeros(6),
            q + noise.joint_position * jax.random.normal(b, q.shape),
            rates + noise.joint_rate * jax.random.normal(c, q.shape),
            fresh,
        )
        kept = jax.tree.map(lambda x, y: jnp.where(fresh, x, y), new, last)
        return replace(kept, fresh=fresh)

    def sample(carry, inputs):
        quaternion, q, rates, rate, momentum, state, last = carry
        time, key, gone = inputs
        changed = time >= history.change
        measured = measure(quaternion, q, rates, rate, key, ~gone, last)
        state, desired = reference.advance(state, time, measured)
        commanded = desired.joint_velocity
        # In B the blocks depend on the joints alone, which are known for the whole sample.
        path = q + jnp.array([[0.0], [0.5], [1.0]]) * period * commanded
        now, halfway, end = _unstacked(jax.vmap(blocks, (0, None))(path, changed))
        docking = changed & (time - period < history.change)
        whole = quaternion_to_matrix(quaternion) @ (now[0] @ rate + now[1] @ rates)
        momentum = jnp.where(docking, whole, momentum)
        # The midpoint rule, for rates that stay as they are over the sample.
        middle = _turned(quaternion, rate_of(quaternion, now, commanded, momentum), period / 2)
        quaternion = _turned(quaternion, rate_of(middle, halfway, commanded, momentum), period)
        rate = rate_of(quaternion, end, commanded, momentum)
        following = quaternion, path[2], commanded, rate, momentum, state, measured
        return following, (rate, quaternion, path[2], commanded, state)

    momentum = jnp.asarray(history.angular_momentum, dtype=float)
    q, rates = jnp.asarray(joint_position, dtype=float), jnp.asarray(joint_velocity, dtype=float)
    rate = rate_of(upright, blocks(q, jnp.array(False)), rates, momentum)
    first = Measured(upright, rate, jnp.zeros(6), q, rates, jnp.array(True))
    times = jnp.arange(num_samples) * period
    start = (upright, q, rates, rate, momentum, reference.begin(first), first)
    _, (base_rate, quaternion, position, velocity, states) = jax.lax.scan(sample, start, (times, keys, lost))
    return CommandedRun(times + period, base_rate, quaternion, position, velocity, states)


def _unstacked(pair: tuple[Array, Array]) -> list[tuple[Array, Array]]:
    return list(zip(*pair, strict=True))


def _turned(quaternion: Quaternion, rate: Vector3, time: Array | float) -> Quaternion:
    """The attitude (4,) after turning at a rate (3,), rad/s, in B, for a time, s."""
    turned = quaternion_multiply(quaternion, rotation_vector_to_quaternion(rate * time))
    return turned / jnp.linalg.norm(turned)
