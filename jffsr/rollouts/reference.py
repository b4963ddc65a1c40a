"""The same motion by the plain path: base pose integrated with the full momentum equation.

It shares nothing with the fast rollout but the joint law: kinematics of each stage in the inertial frame,
a 6 x 6 solve for the base twist, Runge-Kutta on position and quaternion together. Finished plans are
verified with it.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion, sample_joints
from jffsr.rollouts.rollout import check_duration, check_steps
from jffsr.spatial.rotation import quaternion_multiply
from jffsr.trajectories.interface import Trajectory
from jffsr.types import Array, Scalar, Twist

_REACH = np.array([0.0, 0.5, 0.5, 1.0])
_WEIGHT = np.array([1.0, 2.0, 2.0, 1.0]) / 6


def _stage_points(num_steps: int) -> np.ndarray:
    """Indices (N + 1, 4) into the grid of 2N + 1 points of each step's stages; the last step stays put."""
    first = 2 * np.arange(num_steps + 1)[:, None]
    return np.minimum(first + np.array([0, 1, 1, 2]), 2 * num_steps)


def reference_rollout(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    duration: Scalar | float | None = None,
    num_steps: int = 200,
    momentum: Twist | None = None,
    base_mode: str = FLOATING,
) -> Motion:
    """Motion with the arguments and result of `rollout`, by independent code."""
    grid = sample_joints(trajectory, check_duration(trajectory, duration), check_steps(num_steps))
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    step = grid.time[2] - grid.time[0]

    def slope(pose: Array, joints: tuple[Array, Array]) -> tuple[Array, Twist]:
        q, qd = joints
        state = State(base_position=pose[:3], base_quaternion=pose[3:], joint_position=q)
        nu = base_twist(robot, kinematics(robot, state), qd, momentum, base_mode)
        spin = jnp.concatenate([jnp.zeros(1), nu[3:]])
        return jnp.concatenate([nu[:3], 0.5 * quaternion_multiply(spin, pose[3:])]), nu

    def advance(pose: Array, stages) -> tuple[Array, tuple[Array, Twist]]:
        # The four stages are one loop, so that the kinematics is compiled once.
        def stage(carry, inputs):
            last, total = carry
            joints, reach, weight = inputs
            k, nu = slope(pose + reach * step * last, joints)
            return (k, total + weight * k), nu

        zero = jnp.zeros_like(pose)
        (_, total), twists = jax.lax.scan(stage, (zero, zero), (stages, _REACH, _WEIGHT))
        following = pose + step * total
        following = following.at[3:].divide(jnp.linalg.norm(following[3:]))
        return following, (pose, twists[0])

    # One step more than asked for: each reports the pose and twist that it starts from.
    joints = (grid.joint_position, grid.joint_velocity)
    stages = jax.tree.map(lambda x: x[_stage_points(num_steps)], joints)
    initial = jnp.concatenate(
        [jnp.asarray(initial_state.base_position), jnp.asarray(initial_state.base_quaternion)]
    )
    _, (poses, twists) = jax.lax.scan(advance, initial, stages)
    return Motion(
        time=grid.time[::2],
        base_position=poses[:, :3],
        base_quaternion=poses[:, 3:],
        base_twist=twists,
        joint_position=grid.joint_position[::2],
        joint_velocity=grid.joint_velocity[::2],
        joint_acceleration=grid.joint_acceleration[::2],
        momentum=momentum,
        joint_grid=grid,
        base_mode=base_mode,
    )
