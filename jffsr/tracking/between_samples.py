"""The tool's error along the whole of a tracked motion, between the samples too, by independent code."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.tracking.held_rates import rerun
from jffsr.tracking.tool_task import ALL, tracked_error
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracking import Target
from jffsr.types import Array


def errors_between(
    robot: Robot,
    target: Target,
    tracked: Tracked,
    num_steps: int = 8,
    freedom: str = ALL,
    end_effector: str | None = None,
) -> tuple[Array, Array]:
    """Times (K num_steps + 1,), s, and pose errors (K num_steps + 1, 6) in I, with num_steps (static) steps a sample.

    The motion is that of `reference_rollout` from the rates alone. At samples alone it may look better than it is.
    """
    motion = tracked.motion
    finer = rerun(robot, motion, num_steps)
    step = motion.time[1] - motion.time[0]
    parts = jnp.arange(num_steps) / num_steps
    intervals = motion.time.shape[0] - 1

    def along(inside: Array) -> Array:
        """Rows (K, num_steps + 1, ...) of the intervals one after another, each shared end once."""
        return jnp.concatenate([inside[:, :-1].reshape(-1, *inside.shape[2:]), inside[-1, -1:]])

    poses = [along(x) for x in (finer.base_position, finer.base_quaternion, finer.joint_position)]
    time = jnp.append((motion.time[:-1, None] + parts * step).ravel(), intervals * step)

    def off(time: Array, position: Array, quaternion: Array, joints: Array) -> Array:
        tool = end_effector_pose(robot, kinematics(robot, State(position, quaternion, joints)), end_effector)
        goal = target(time)
        return tracked_error(freedom, *tool, goal.position, goal.quaternion)

    return time, jax.vmap(off)(time, *poses)
