"""A reference that holds the base still with a load it learns: reaction null space rates from the estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Any

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.reactionless.estimation.balance import balance_of
from jffsr.reactionless.estimation.models import LoadModel
from jffsr.reactionless.interface import Desired, Measured
from jffsr.reactionless.null_space import ALL_AXES, absorbing, attitude_task, checked_axes, coupling_rank
from jffsr.reactionless.ranges import RangesKept
from jffsr.robots.robot import Robot
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_rotation_vector
from jffsr.spatial.safe import safe_norm
from jffsr.types import Array, Quaternion, Scalar, Vector


class AdaptiveCode(IntEnum):
    """What was in the way at a sample; 0 is nothing."""

    HELD = 0
    MEASUREMENT_LOST = 1
    RATE_LIMITED = 2
    RANK_LOST = 3
    NOT_FINITE = 4


ADAPTIVE_SENTENCES = {
    AdaptiveCode.HELD: "the commanded rates absorb the estimated momentum",
    AdaptiveCode.MEASUREMENT_LOST: "there was no measurement; the last estimate goes on",
    AdaptiveCode.RATE_LIMITED: "the joints' rate limits do not let the estimated momentum be absorbed",
    AdaptiveCode.RANK_LOST: "the estimated coupling has not the rank to absorb the estimated momentum in this posture",
    AdaptiveCode.NOT_FINITE: "the rates found are not finite; the last ones are kept",
}

# Share of the momentum that may stay unabsorbed before the rank counts as lost.
_UNABSORBED = 1e-6


@register_dataclass
@dataclass(frozen=True, eq=False)
class AdaptiveState:
    """model: the load model's state; joint_position and joint_velocity (n,): what is commanded;
    start_quaternion (4,): the attitude to hold; rank (), of the estimated coupling; code (), of `AdaptiveCode`."""

    model: Any
    joint_position: Vector
    joint_velocity: Vector
    start_quaternion: Quaternion
    rank: Scalar
    code: Scalar


@register_dataclass
@dataclass(frozen=True)
class AdaptiveReactionless:
    """A `Reference`: qd = H# (L + gain H_w e) + r + s (1 - H# H) zeta(t), with the blocks that the model estimates.

    robot: without its load; model: learns the load; period, s, of the samples; null_rate: zeta (n,), rad/s, at a
    time, None for none. rate_limit (n,) or scalar, rad/s: s is the largest share in [0, 1] of the null motion that
    keeps it, and if the rest exceeds it alone, that is scaled down and the state says so. acceleration_limit,
    rad/s^2: how fast commanded rates may change. attitude_gain, 1/s: feeds back the base's rotation e since the
    start. rank_cut: singular values of the estimated coupling below that share of the largest are taken for errors
    of the estimate. ranges: makes the part r of the null space that leads joints off the ends of their ranges, before
    zeta, which it turns aside there, and like it only as far as the rate limits allow; None for none. axes, static:
    those of B to hold; a planar arm can hold only the one it turns about, and what noise makes of the others is not to
    be answered. learn, static: false keeps the model as it begins. end_effector, static: what carries the load, None
    the first.
    """

    robot: Robot
    model: LoadModel
    period: Array | float
    null_rate: Callable[[Scalar], Vector] | None = None
    rate_limit: Array | float = jnp.inf
    acceleration_limit: Array | float = jnp.inf
    attitude_gain: Array | float = 0.0
    rank_cut: Array | float = 1e-3
    ranges: RangesKept | None = None
    axes: tuple[int, ...] = field(default=ALL_AXES, metadata={"static": True})
    learn: bool = field(default=True, metadata={"static": True})
    end_effector: str | None = field(default=None, metadata={"static": True})

    def begin(self, measured: Measured) -> AdaptiveState:
        """From where the joints are, as fast as they move."""
        balance = balance_of(self.robot, measured, self.end_effector)
        none = jnp.zeros((), dtype=jnp.int32)
        return AdaptiveState(
            self.model.begin(balance),
            measured.joint_position,
            measured.joint_velocity,
            measured.base_quaternion,
            none,
            none,
        )

    def advance(
        self, state: AdaptiveState, time: Scalar, measured: Measured
    ) -> tuple[AdaptiveState, Desired]:
        """Learn from the sample, and command the rates until the next."""
        # Without a measurement the joints are where they were told to be, rather than where they were last seen.
        there = jnp.asarray(measured.fresh) & jnp.all(jnp.isfinite(measured.joint_position))
        position = jnp.where(there, measured.joint_position, state.joint_position)
        balance = balance_of(self.robot, replace(measured, joint_position=position), self.end_effector)
        model = self.model.update(state.model, balance) if self.learn else state.model
        locked, coupling, momentum = self.model.blocks(model, balance)
        away = quaternion_multiply(quaternion_conjugate(state.start_quaternion), measured.base_quaternion)
        back = jnp.where(balance.usable, quaternion_to_rotation_vector(away), 0.0)
        # A base that is away turns back at the gain times the way.
        asked = momentum + self.attitude_gain * (locked @ back)
        task, wanted = attitude_task(jnp.eye(3), locked, coupling, asked, checked_axes(self.axes))
        least, space, sigma = absorbing(task, wanted, self.rank_cut)
        unabsorbed = safe_norm(wanted - task @ least) > _UNABSORBED * safe_norm(wanted)
        zeta = jnp.zeros_like(least) if self.null_rate is None else space @ self.null_rate(time)
        aside = jnp.zeros_like(least)
        if self.ranges is not None:
            gain, inward = self.ranges.correction(self.robot.limits, position, space)
            aside, zeta = gain @ (inward - least), zeta - gain @ zeta
        rates, limited = _within(least, aside, self.rate_limit)
        rates, _ = _within(rates, zeta, self.rate_limit)
        finite = jnp.all(jnp.isfinite(rates))
        rates = jnp.where(finite, rates, state.joint_velocity)
        change = rates - state.joint_velocity
        fastest = jnp.max(jnp.abs(change) / self.period / self.acceleration_limit)
        rates = state.joint_velocity + change / jnp.maximum(fastest, 1.0)
        code = AdaptiveCode.HELD
        for met, found in (
            (~balance.usable, AdaptiveCode.MEASUREMENT_LOST),
            (limited, AdaptiveCode.RATE_LIMITED),
            (unabsorbed, AdaptiveCode.RANK_LOST),
            (~finite, AdaptiveCode.NOT_FINITE),
        ):
            code = jnp.where(met, found, code)
        following = AdaptiveState(
            model,
            state.joint_position + self.period * rates,
            rates,
            state.start_quaternion,
            coupling_rank(sigma, self.rank_cut),
            jnp.asarray(code, dtype=jnp.int32),
        )
        acceleration = (rates - state.joint_velocity) / self.period
        return following, Desired(state.joint_position, rates, acceleration)


def _within(least: Vector, free: Vector, limit: Array | float) -> tuple[Vector, Scalar]:
    """The largest share of the free motion on top of the least that keeps the limit, and whether the least did not."""
    limit = jnp.broadcast_to(jnp.asarray(limit, dtype=float), least.shape)
    over = jnp.max(jnp.abs(least) / limit)
    least = least / jnp.maximum(over, 1.0)
    room = jnp.where(free > 0, limit - least, limit + least)
    moving = free != 0
    share = jnp.min(jnp.where(moving, room / jnp.where(moving, jnp.abs(free), 1.0), jnp.inf))
    return least + jnp.clip(share, 0.0, 1.0) * free, over > 1.0
