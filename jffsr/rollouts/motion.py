"""What a rollout returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp

from jffsr.dynamics.base_mode import FLOATING
from jffsr.pytrees import register_dataclass
from jffsr.trajectories.interface import Trajectory
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class JointGrid:
    """Joint motion at the 2N + 1 grid points and midpoints that a Runge-Kutta step needs.

    time (2N + 1,), s; joint_position, joint_velocity, joint_acceleration (2N + 1, n).
    """

    time: Array
    joint_position: Array
    joint_velocity: Array
    joint_acceleration: Array


@register_dataclass
@dataclass(frozen=True)
class Motion:
    """A motion of the whole robot on N + 1 samples.

    time (N + 1,), s; base_position (N + 1, 3), m, and base_quaternion (N + 1, 4), B to I; base_twist
    (N + 1, 6), [linear; angular] in I; joint_position, joint_velocity, joint_acceleration (N + 1, n);
    momentum (6,), P and L about the system centre of mass; joint_grid, the same joint motion on the finer
    grid of 2N + 1 points, from which peaks are read. joint_torque (N + 1, n), N m or N, where `with_joint_torque` has
    added it. base_mode, static, says how the base was held: with the attitude held only P is the robot's own, on a
    fixed base neither.
    """

    time: Array
    base_position: Array
    base_quaternion: Array
    base_twist: Array
    joint_position: Array
    joint_velocity: Array
    joint_acceleration: Array
    momentum: Array
    joint_grid: JointGrid
    joint_torque: Array | None = None
    base_mode: str = field(default=FLOATING, metadata={"static": True})


SAMPLED = (
    "time",
    "base_position",
    "base_quaternion",
    "base_twist",
    "joint_position",
    "joint_velocity",
    "joint_acceleration",
)
"""Fields of a Motion that have a row a sample."""


def sample_joints(trajectory: Trajectory, duration: Scalar, num_steps: int) -> JointGrid:
    """The trajectory on the 2 num_steps + 1 points of the grid and its midpoints."""
    time = jnp.linspace(0.0, 1.0, 2 * num_steps + 1) * duration
    on_grid = getattr(trajectory, "on_grid", None) or jax.vmap(trajectory, out_axes=-1)
    # Time runs along the last axis here: loops over the few joints would be too short for vector registers.
    position, velocity, acceleration = (jax.lax.optimization_barrier(x).T for x in on_grid(time))
    return JointGrid(time, position, velocity, acceleration)
