"""The computer's half of a sampled loop: sensors, reference, controller, delay and limits, the same for every plant."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.interface import Controller, Desired, Measured, Reference
from jffsr.reactionless.plant_settings import LoopSettings
from jffsr.robots.state import State
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class Memory:
    """What the computer carries from sample to sample: states of reference and controller, torques (delay, n) on their
    way, oldest first, what was measured last, and the base's twist (6,) one sample ago."""

    reference: Any
    controller: Any
    queue: Array
    measured: Measured
    base_twist: Array


@register_dataclass
@dataclass(frozen=True)
class Decision:
    """A sample's outcome: desired motion, torques (n,) asked for and given, where the limit acted, the disturbance (n,)
    of the joints, and whether anything was measured."""

    desired: Desired
    asked: Vector
    torque: Vector
    limited: Vector
    disturbance: Vector
    fresh: Scalar


def begin(
    reference: Reference, controller: Controller, settings: LoopSettings, state: State, key: Array
) -> Memory:
    """The memory before the first sample; the first measurement is that of sample 0 and is never lost."""
    n = state.joint_position.shape[0]
    measured = measure(settings, state, jnp.zeros(6), jax.random.fold_in(key, 0))
    return Memory(
        _strong(reference.begin(measured)),
        _strong(controller.begin(measured)),
        jnp.zeros((settings.delay, n)),
        measured,
        state.base_twist,
    )


def decide(
    reference: Reference,
    controller: Controller,
    settings: LoopSettings,
    memory: Memory,
    index: Scalar,
    state: State,
    key: Array,
) -> tuple[Memory, Decision]:
    """Sample `index`: the true state is measured, the reference and the controller move on, a torque comes out."""
    time = index * settings.period
    draw = jax.random.fold_in(key, index)
    acceleration = (state.base_twist - memory.base_twist) / settings.period
    measured = measure(settings, state, acceleration, draw)
    sensors = settings.sensors
    # The margin of half a period keeps rounding of index times period out of it.
    late = time + 0.5 * settings.period
    lost = (late > sensors.lost_from) & (late < sensors.lost_until) & (index > 0)
    held = replace(memory.measured, fresh=jnp.array(False))
    measured = jax.tree.map(lambda old, new: jnp.where(lost, old, new), held, measured)
    reference_state, desired = reference.advance(memory.reference, time, measured)
    controller_state, asked = controller.advance(memory.controller, time, measured, desired)
    queue = jnp.concatenate([memory.queue, asked[None]])
    limit = jnp.broadcast_to(jnp.asarray(settings.torque_limit, dtype=float), asked.shape)
    torque = jnp.clip(queue[0], -limit, limit)
    share = jax.random.uniform(jax.random.fold_in(draw, 1), asked.shape)
    push = settings.disturbance
    disturbance = push.constant + push.random * share * jnp.sign(state.joint_velocity)
    following = Memory(reference_state, controller_state, queue[1:], measured, state.base_twist)
    return following, Decision(desired, asked, torque, jnp.abs(queue[0]) > limit, disturbance, measured.fresh)


def measure(settings: LoopSettings, state: State, acceleration: Vector, key: Array) -> Measured:
    """The sensors' values of a true state."""
    sensors = settings.sensors
    keys = jax.random.split(jax.random.fold_in(key, 0), 4)

    def noisy(key: Array, deviation: Scalar | float, true: Array) -> Array:
        return true + deviation * jax.random.normal(key, true.shape)

    return Measured(
        base_quaternion=state.base_quaternion,
        base_rate=noisy(keys[0], sensors.gyro, state.base_twist[3:]),
        base_acceleration=noisy(keys[1], sensors.accelerometer, acceleration),
        joint_position=noisy(keys[2], sensors.encoder, state.joint_position),
        joint_velocity=noisy(keys[3], sensors.rate, state.joint_velocity),
        fresh=jnp.array(True),
    )


def _strong(tree: Any) -> Any:
    """Numbers of fixed types, as a loop's carry must have them."""
    return jax.tree.map(lambda x: jax.lax.convert_element_type(x, jnp.asarray(x).dtype), tree)
