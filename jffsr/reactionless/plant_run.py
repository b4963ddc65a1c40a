"""What a closed loop did, sample by sample, and what became of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.plant_settings import LoopSettings
from jffsr.robots.state import State
from jffsr.types import Array, Scalar


class LoopCode(IntEnum):
    """0 is the only full success; under 1 a limit acted, and the reference was kept all the same."""

    KEPT = 0
    TORQUE_LIMITED = 1
    SATURATED = 2
    REFERENCE_LOST = 3
    DIVERGED = 4
    NOT_FINITE = 5


_SENTENCES = {
    LoopCode.KEPT: "the loop is stable and keeps its reference",
    LoopCode.TORQUE_LIMITED: "torque limits acted for a while; the loop is stable and keeps its reference",
    LoopCode.SATURATED: "a joint was at its torque limit for too long to be under control: ask for slower motion, or "
    "allow more torque",
    LoopCode.REFERENCE_LOST: "the loop is stable but does not keep its reference: look for a disturbance that the "
    "controller does not learn, too little torque, or measurements that were lost",
    LoopCode.DIVERGED: "the loop is unstable, rates grew beyond any use: lower the gains, the delay or the period",
    LoopCode.NOT_FINITE: "the loop's numbers are not finite: lower the gains or the period, or raise substeps",
}


def loop_sentence(code: Array | int) -> str:
    """What a result code means, with advice."""
    return _SENTENCES[LoopCode(int(code))]


@register_dataclass
@dataclass(frozen=True)
class LoopRun:
    """A closed loop at its N samples, each before its torque acts.

    time (N,), s; states, a State whose leaves are (N, ...), with velocities; desired_position, desired_velocity and
    desired_acceleration (N, n); asked_torque (N, n), by the controller at that sample; torque (N, n), what the motors
    gave over the period, delayed and limited; limited (N, n), bool, whether the limit acted; disturbance (N, n);
    momentum (N, 6), P, then L about the system centre of mass, in I; fresh (N,), bool; code (), an int32 LoopCode.
    """

    time: Array
    states: State
    desired_position: Array
    desired_velocity: Array
    desired_acceleration: Array
    asked_torque: Array
    torque: Array
    limited: Array
    disturbance: Array
    momentum: Array
    fresh: Array
    code: Array

    @property
    def error(self) -> Array:
        """Joint position less what was desired (N, n), rad or m, the paper's e."""
        return self.states.joint_position - self.desired_position

    @property
    def sentence(self) -> str:
        """What became of one run."""
        return loop_sentence(self.code)


def loop_code(settings: LoopSettings, states: State, error: Array, torque: Array, limited: Array) -> Scalar:
    """The worst that is the case of states (N, ...), errors, torques and limits that acted (N, n); int32."""
    bounds = settings.bounds
    finite = jnp.all(jnp.isfinite(error)) & jnp.all(jnp.isfinite(torque))
    for leaf in (states.base_twist, states.joint_velocity, states.base_quaternion):
        finite &= jnp.all(jnp.isfinite(leaf))
    rates = jnp.max(jnp.abs(states.joint_velocity))
    spin = jnp.max(jnp.linalg.norm(states.base_twist[:, 3:], axis=-1))
    # Written so that a NaN never counts as within.
    within = (rates <= bounds.joint_rate) & (spin <= bounds.base_rate)
    last = np.arange(settings.samples) >= settings.samples - max(1, settings.samples // 10)
    kept = jnp.max(jnp.where(last[:, None], jnp.abs(error), 0.0)) <= bounds.error
    saturated = longest_stretch(limited) * settings.period > bounds.saturation
    cases = (
        (~finite, LoopCode.NOT_FINITE),
        (~within, LoopCode.DIVERGED),
        (saturated, LoopCode.SATURATED),
        (~kept, LoopCode.REFERENCE_LOST),
        (jnp.any(limited), LoopCode.TORQUE_LIMITED),
    )
    code = jnp.asarray(LoopCode.KEPT, dtype=jnp.int32)
    for case, value in reversed(cases):
        code = jnp.where(case, jnp.int32(value), code)
    return code


def longest_stretch(flags: Array) -> Scalar:
    """The most samples in a row at which any one of the flags (N, n) stays true."""

    def count(length, flag):
        length = jnp.where(flag, length + 1, 0)
        return length, length

    _, lengths = jax.lax.scan(count, jnp.zeros(flags.shape[1:], dtype=int), flags)
    return jnp.max(lengths)
