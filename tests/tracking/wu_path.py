"""The straight tool path of Wu et al. 2018, and other small targets, written out for the tests."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.robots.state import State
from jffsr.spatial.rotation import (
    matrix_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotation_vector_to_quaternion,
)
from jffsr.trajectories.cartesian.interface import ToolTarget

START = np.deg2rad([175, -60, -60, 0, 210, 5])
PRINTED_START = np.array([1.37, -0.08, 0.64]), (-3.14, 0.0, -2.97)
PRINTED_GOAL = np.array([1.50, 0.0, -0.2]), (-3.16, -0.26, -3.14)


def turn(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = c
    matrix[i, j], matrix[j, i] = -s, s
    return matrix


def printed_quaternion(angles) -> jax.Array:
    """The tool's rotation is the transpose of Rx(a) Ry(b) Rz(c)."""
    a, b, c = angles
    return matrix_to_quaternion(jnp.asarray((turn(0, a) @ turn(1, b) @ turn(2, c)).T))


def state_at(joints, position=(0.0, 0.0, 0.0), quaternion=(1.0, 0.0, 0.0, 0.0)) -> State:
    return State(np.array(position), np.array(quaternion), np.asarray(joints, dtype=float))


def centre_of_mass(robot, state):
    return system_com(robot, kinematics(robot, state))


def tool_pose(robot, state):
    return end_effector_pose(robot, kinematics(robot, state))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Straight:
    """From one pose to another along a line and about one axis, with a trapezoidal rate of ramps `ramp` long."""

    start: jax.Array
    start_quaternion: jax.Array
    goal: jax.Array
    turn: jax.Array
    duration: jax.Array
    ramp: jax.Array

    @classmethod
    def between(cls, start, goal, duration, ramp=0.2):
        between = quaternion_multiply(goal[1], quaternion_conjugate(start[1]))
        axis = quaternion_to_rotation_vector(between)
        return cls(
            jnp.asarray(start[0]),
            start[1],
            jnp.asarray(goal[0]),
            axis,
            jnp.asarray(float(duration)),
            jnp.asarray(ramp),
        )

    def __call__(self, time):
        t, r = jnp.clip(time / self.duration, 0.0, 1.0), self.ramp
        top = 1 / (1 - r)
        s = jnp.where(
            t < r,
            top * t**2 / (2 * r),
            jnp.where(t > 1 - r, 1 - top * (1 - t) ** 2 / (2 * r), top * (t - r / 2)),
        )
        rate = top * jnp.clip(jnp.minimum(t, 1 - t) / r, 0.0, 1.0) / self.duration
        quaternion = quaternion_multiply(rotation_vector_to_quaternion(s * self.turn), self.start_quaternion)
        line = self.goal - self.start
        twist = jnp.concatenate([line, self.turn])
        return ToolTarget(self.start + s * line, quaternion, rate * twist, jnp.zeros(6))


def wu_path(robot, duration, given=False, ramp=0.2) -> Straight:
    position, quaternion = tool_pose(robot, state_at(START))
    start = (PRINTED_START[0], printed_quaternion(PRINTED_START[1])) if given else (position, quaternion)
    goal = PRINTED_GOAL[0], printed_quaternion(PRINTED_GOAL[1])
    return Straight.between(start, goal, duration, ramp)
