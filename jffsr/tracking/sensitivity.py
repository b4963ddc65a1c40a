"""How the tool's error along a motion answers to each held joint rate and to the target's pace: the whole rollout's
derivative, from those of its single intervals."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import JointGrid
from jffsr.rollouts.rollout import rollout_grid
from jffsr.spatial.rotation import quaternion_multiply, rotation_vector_to_quaternion
from jffsr.tracking.tool_task import pose_error, tracked_error
from jffsr.tracking.tracked import Tracked
from jffsr.types import Array

_STEPS = 2  # of Runge-Kutta an interval: a derivative need not be as exact as the motion


def sensitivity(
    robot: Robot, target: Any, own_time: Array, tracked: Tracked, freedom: str, end_effector: str | None
) -> tuple[Array, Array, Array]:
    """Error (K, 6) of the tool at samples 1 to K, its derivative (K, 6, K, n) by the rates held and (K, 6) by own_time.

    The target is taken at own_time (K + 1,), s; the error is what `freedom` counts of it. Small turns of the base are
    rotation vectors in I, so that a state has 6 + n numbers.
    """
    motion, n = tracked.motion, robot.num_joints
    step = motion.time[1] - motion.time[0]
    rates = motion.joint_velocity[:-1]
    count = rates.shape[0]

    def moved(pose: tuple[Array, Array, Array], by: Array) -> State:
        position, quaternion, joints = pose
        turned = quaternion_multiply(rotation_vector_to_quaternion(by[3:6]), quaternion)
        return State(position + by[:3], turned, joints + by[6:])

    def following(pose: tuple, after: tuple, by: Array, rate: Array) -> Array:
        """Where an interval leads (6 + n,), relative to where it led."""
        state = moved(pose, by)
        share = jnp.linspace(0.0, 1.0, 2 * _STEPS + 1)[:, None] * step
        held = jnp.broadcast_to(rate, (2 * _STEPS + 1, n))
        grid = JointGrid(share[:, 0], state.joint_position + share * rate, held, jnp.zeros_like(held))
        end = rollout_grid(robot, grid, state, motion.momentum, motion.base_mode)
        base = pose_error(end.base_position[-1], end.base_quaternion[-1], *after[:2])
        return jnp.concatenate([base, end.joint_position[-1] - after[2]])

    def off(pose: tuple, by: Array, time: Array) -> Array:
        tool = end_effector_pose(robot, kinematics(robot, moved(pose, by)), end_effector)
        goal = target(time)
        return tracked_error(freedom, *tool, goal.position, goal.quaternion)

    poses = motion.base_position, motion.base_quaternion, motion.joint_position
    before, after = (tuple(x[part] for x in poses) for part in (slice(None, -1), slice(1, None)))
    still = jnp.zeros((count, 6 + n))
    by_state, by_rate = jax.vmap(jax.jacfwd(following, (2, 3)))(before, after, still, rates)
    error_by_state, by_time = jax.vmap(jax.jacfwd(off, (1, 2)))(after, still, own_time[1:])

    def carried(so_far: Array, row: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        across, own, k = row
        so_far = jnp.einsum("ij,jkn->ikn", across, so_far)
        so_far = jax.lax.dynamic_update_slice(so_far, own[:, None], (0, k, 0))
        return so_far, so_far

    _, state_by_rates = jax.lax.scan(
        carried, jnp.zeros((6 + n, count, n)), (by_state, by_rate, jnp.arange(count))
    )
    error = jax.vmap(off)(after, still, own_time[1:])
    return error, jnp.einsum("kij,kjln->kiln", error_by_state, state_by_rates), by_time
