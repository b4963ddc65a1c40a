"""A tracked motion run again by independent code at finer steps, and how far the two are apart."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.dynamics.base_mode import base_freedom
from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.dynamics.spatial_tree import body_twists, spatial_inertias
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.conservation import momentum_from_poses
from jffsr.rollouts.motion import Motion
from jffsr.tracking.held_rates import rerun
from jffsr.tracking.tool_task import pose_error
from jffsr.tracking.tracked import Tracked
from jffsr.types import Array, Scalar

# The least number of steps within which central differences of order 8 have a sample in their middle.
LEAST_STEPS = 8


@register_dataclass
@dataclass(frozen=True)
class TrackingVerification:
    """What the finer re-run by the reference path says of a tracked motion.

    attitude_difference, rad, and position_difference, m, of the base and tool_position_difference, m, and
    tool_attitude_difference, rad, of the tool: largest between the two runs at the samples; momentum_drift: relative,
    from differenced poses within the samples; position_error, m, and attitude_error, rad: the largest of the finer
    run's tool from its target, and end_position_error and end_attitude_error at the end; overruns (n,) of the limits
    of position, relative to half the range, of rate and of the change of rate from sample to sample: negative inside,
    -1 or -inf where nothing moves.
    """

    attitude_difference: Scalar
    position_difference: Scalar
    tool_position_difference: Scalar
    tool_attitude_difference: Scalar
    momentum_drift: Scalar
    position_error: Scalar
    attitude_error: Scalar
    end_position_error: Scalar
    end_attitude_error: Scalar
    position_overrun: Array
    rate_overrun: Array
    acceleration_overrun: Array


def verify_tracking(
    robot: Robot, tracked: Tracked, end_effector: str | None = None, num_steps: int = 2 * LEAST_STEPS
) -> TrackingVerification:
    """The verification of a motion by this robot, with num_steps (static, at least 8) steps a sample."""
    motion, finer = tracked.motion, rerun(robot, tracked.motion, max(num_steps, LEAST_STEPS))
    ends = tuple(
        jnp.concatenate([jnp.asarray(first)[:1], last[:, -1]])
        for first, last in (
            (motion.base_position, finer.base_position),
            (motion.base_quaternion, finer.base_quaternion),
        )
    )
    tool = jax.vmap(
        lambda p, a, q: end_effector_pose(robot, kinematics(robot, State(p, a, q)), end_effector)
    )(*ends, motion.joint_position)
    base_apart = pose_error(*ends, motion.base_position, motion.base_quaternion)
    tool_apart = pose_error(*tool, tracked.tool_position, tracked.tool_quaternion)
    error = pose_error(*tool, tracked.target_position, tracked.target_quaternion)
    return TrackingVerification(
        attitude_difference=_largest(base_apart[:, 3:]),
        position_difference=_largest(base_apart[:, :3]),
        tool_position_difference=_largest(tool_apart[:, :3]),
        tool_attitude_difference=_largest(tool_apart[:, 3:]),
        momentum_drift=_momentum_drift(robot, motion, finer),
        position_error=_largest(error[:, :3]),
        attitude_error=_largest(error[:, 3:]),
        end_position_error=jnp.linalg.norm(error[-1, :3]),
        end_attitude_error=jnp.linalg.norm(error[-1, 3:]),
        **_overruns(robot, motion),
    )


def _largest(rows: Array) -> Scalar:
    return jnp.max(jnp.linalg.norm(rows, axis=-1))


def _momentum_drift(robot: Robot, motion: Motion, finer: Motion) -> Scalar:
    """Largest deviation of the momentum from differenced poses, over the largest sum of what the bodies carry."""
    freedom = base_freedom(motion.base_mode)
    if freedom == 0:
        return jnp.zeros(())
    found = jax.vmap(lambda part: momentum_from_poses(robot, part))(finer)
    off = jnp.max(jnp.linalg.norm((found - motion.momentum).reshape(-1, 2, 3), axis=-1), axis=0)
    carried = jax.vmap(lambda *sample: _carried(robot, *sample))(
        motion.base_position,
        motion.base_quaternion,
        motion.joint_position,
        motion.base_twist,
        motion.joint_velocity,
    )
    size = jnp.max(carried, axis=0)
    # A motion that stands still has no drift: what is left of its differences is rounding.
    relative = off / jnp.maximum(size, jnp.sqrt(jnp.finfo(size.dtype).eps))
    return relative[0] if freedom == 3 else jnp.max(relative)


def _carried(robot: Robot, position: Array, quaternion: Array, q: Array, twist: Array, rate: Array) -> Array:
    """Sums (2,) over the bodies of the sizes of their linear momenta, and of the angular ones about the system's centre
    of mass."""
    kin = kinematics(robot, State(position, quaternion, q))
    momenta = jnp.einsum("bij,bj->bi", spatial_inertias(robot, kin), body_twists(robot, kin, twist, rate))
    lever = system_com(robot, kin) - kin.base_position
    linear, angular = momenta[:, :3], momenta[:, 3:] - jnp.cross(lever, momenta[:, :3])
    return jnp.stack([jnp.sum(jnp.linalg.norm(x, axis=-1)) for x in (linear, angular)])


def _overruns(robot: Robot, motion: Motion) -> dict[str, Array]:
    limits, q = robot.limits, motion.joint_position
    lower, upper = jnp.asarray(limits.position_lower), jnp.asarray(limits.position_upper)
    half = jnp.where(jnp.isfinite(upper - lower), (upper - lower) / 2, 1.0)
    return {
        "position_overrun": jnp.max(jnp.maximum(q - upper, lower - q), axis=0) / half,
        "rate_overrun": jnp.max(jnp.abs(motion.joint_velocity), axis=0) / limits.velocity - 1,
        "acceleration_overrun": jnp.max(jnp.abs(motion.joint_acceleration), axis=0) / limits.acceleration - 1,
    }
