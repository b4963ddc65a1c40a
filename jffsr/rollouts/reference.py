"""The same motion by the plain path: base pose integrated with the full momentum equation.

It shares nothing with the fast rollout but the joint law: kinematics of each stage in the inertial frame,
a 6 x 6 solve for the base twist, Runge-Kutta on position and quaternion together. Finished plans are
verified with it.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp

from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion, sample_joints
from jffsr.rollouts.rollout import check_duration, check_steps
from jffsr.spatial.rotation import quaternion_multiply
from jffsr.trajectories.interface import Trajectory
from jffsr.types import Array, Scalar, Twist


def reference_rollout(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    duration: Scalar | float | None = None,
    num_steps: int = 200,
    momentum: Twist | None = None,
) -> Motion:
    """Motion with the arguments and result of `rollout`, by independent code."""
    grid = sample_joints(trajectory, check_duration(trajectory, duration), check_steps(num_steps))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    step = grid.time[2] - grid.time[0]

    def twist(pose: Array, q: Array, qd: Array) -> Array:
        state = State(base_position=pose[:3], base_quaternion=pose[3:], joint_position=q)
        return base_twist(robot, kinematics(robot, state), qd, momentum)

    def rate(pose: Array, stage: tuple[Array, Array]) -> Array:
        nu = twist(pose, *stage)
        spin = jnp.concatenate([jnp.zeros(1), nu[3:]])
        return jnp.concatenate([nu[:3], 0.5 * quaternion_multiply(spin, pose[3:])])

    def advance(pose: Array, stages) -> tuple[Array, Array]:
        first, middle, last = stages
        k1 = rate(pose, first)
        k2 = rate(pose + 0.5 * step * k1, middle)
        k3 = rate(pose + 0.5 * step * k2, middle)
        k4 = rate(pose + step * k3, last)
        pose = pose + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        pose = pose.at[3:].divide(jnp.linalg.norm(pose[3:]))
        return pose, pose

    joints = (grid.joint_position, grid.joint_velocity)
    stages = tuple(
        tuple(x[part] for x in joints) for part in (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
    )
    initial = jnp.concatenate(
        [jnp.asarray(initial_state.base_position), jnp.asarray(initial_state.base_quaternion)]
    )
    _, later = jax.lax.scan(advance, initial, stages)
    poses = jnp.concatenate([initial[None], later])
    return Motion(
        time=grid.time[::2],
        base_position=poses[:, :3],
        base_quaternion=poses[:, 3:],
        base_twist=jax.vmap(twist)(poses, joints[0][::2], joints[1][::2]),
        joint_position=grid.joint_position[::2],
        joint_velocity=grid.joint_velocity[::2],
        joint_acceleration=grid.joint_acceleration[::2],
        momentum=momentum,
        joint_grid=grid,
    )
