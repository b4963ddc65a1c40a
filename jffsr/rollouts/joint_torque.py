"""The joint torques that a motion takes: inverse dynamics of its samples, the base reacting freely.

The torque of the reduced equations, N(q) qdd + K(q, qd) (Hu, Wang and Shi 2011, eq. (4)), the base's own acceleration
eliminated. It does not depend on where the base is, how it is turned or how fast it drifts, so that the posture is
taken in the base frame: of the base only its angular velocity there counts.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp

from jffsr.dynamics.equations_of_motion import inverse_dynamics
from jffsr.dynamics.kinematics import kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.hot_torque import hot_joint_torque
from jffsr.rollouts.kernels import FAST, PLAIN, check_kernel
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Quaternion, Twist, Vector


def joint_torque(robot: Robot, motion: Motion, kernel: str = FAST) -> Array:
    """Joint torques (N + 1, n), N m or N, at a motion's samples, under its own base_mode and momentum.

    kernel (static) is fast, or plain for the textbook's inverse dynamics of each sample, which gives the same. Raises
    InputError for another.
    """
    return _KERNELS[check_kernel(kernel)](robot, motion)


def with_joint_torque(robot: Robot, motion: Motion, kernel: str = FAST) -> Motion:
    """The motion with its joint torques in it, so that they are computed once for all that reads them."""
    if motion.joint_torque is not None:
        return motion
    return replace(motion, joint_torque=joint_torque(robot, motion, kernel))


def _plain_joint_torque(robot: Robot, motion: Motion) -> Array:
    def at(quaternion: Quaternion, twist: Twist, q: Vector, qd: Vector, qdd: Vector) -> Vector:
        spin = quaternion_to_matrix(quaternion).T @ twist[3:]
        kin = kinematics(robot, State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), q))
        turning = jnp.concatenate([jnp.zeros(3), spin])
        return inverse_dynamics(robot, kin, turning, qd, qdd, motion.base_mode)[0]

    return jax.vmap(at)(
        jnp.asarray(motion.base_quaternion),
        jnp.asarray(motion.base_twist),
        jnp.asarray(motion.joint_position),
        jnp.asarray(motion.joint_velocity),
        jnp.asarray(motion.joint_acceleration),
    )


_KERNELS = {FAST: hot_joint_torque, PLAIN: _plain_joint_torque}
