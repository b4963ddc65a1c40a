"""What both engines are given: the joint motion on the step grid, and the torque that follows it.

The torque is a computed torque from the engine's own inertia matrix and bias force, with the free base
eliminated: no external wrench acts, so H_b a_b + H_bm a + c_b = 0 gives the base acceleration a_b, and
tau = H_bm' a_b + H_m a + c_m. The commanded joint acceleration a is the mean over the step plus position and
rate feedback. A torque held over a step of length h moves the error of a double integrator by
x+ = x + h v + h^2 a/2, v+ = v + h a; the gains 1/h^2 and 3/(2 h) put both of its poles at zero, so an error
is gone after two steps. Such gains are only good for an exact model, which is what is tested here.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.crosscheck.mujoco_model import BASE_VELOCITIES, branch_order
from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import base_twist
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.trajectories.interface import Trajectory


@dataclass(frozen=True)
class Drive:
    """A joint motion to follow with `substeps` equal steps in each of K sample intervals (host arrays).

    step, s; time (K + 1,), s, of the samples; joint_position and joint_velocity (K substeps + 1, n) at the
    step boundaries; mean_acceleration (K substeps, n) over each step; qpos (7 + n,) and qvel (6 + n,), the
    initial state. All joints are in MuJoCo's order; order (n,) is the robot's joint at each of its places.
    """

    step: float
    substeps: int
    time: np.ndarray
    joint_position: np.ndarray
    joint_velocity: np.ndarray
    mean_acceleration: np.ndarray
    qpos: np.ndarray
    qvel: np.ndarray
    order: np.ndarray

    def robot_order(self, joints: np.ndarray) -> np.ndarray:
        """Joint values (..., n) brought from MuJoCo's order into the robot's."""
        return joints[..., np.argsort(self.order)]


@dataclass(frozen=True)
class EngineMotion:
    """A motion as an engine made it, at the K + 1 sample times (host arrays).

    time (K + 1,), s; base_position (K + 1, 3), m; base_quaternion (K + 1, 4), B to I; joint_position
    (K + 1, n); momentum (K + 1, 6), P and L about the system centre of mass, from the engine's own
    velocities; momentum_share (2,), the largest linear and angular momentum (about the system centre of
    mass) that any one body ever has; tracking_error, rad or m, the largest over all steps and joints;
    compile_seconds and run_seconds.
    """

    time: np.ndarray
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray
    momentum: np.ndarray
    momentum_share: np.ndarray
    tracking_error: float
    compile_seconds: float
    run_seconds: float


def check_x64() -> None:
    """InputError unless JAX computes in double precision, without which no difference means anything."""
    if not jax.config.jax_enable_x64:
        raise InputError(
            "the cross-check needs double precision: call jax.config.update('jax_enable_x64', True) first"
        )


def make_drive(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    sample_time: np.ndarray,
    largest_step: float,
    momentum: np.ndarray,
) -> Drive:
    """The drive with the fewest steps per sample interval that are no longer than `largest_step`, s."""
    intervals, duration = len(sample_time) - 1, float(sample_time[-1])
    # Without the margin, rounding of duration / intervals would add a step to an exact division.
    substeps = max(1, int(np.ceil(duration / intervals / largest_step * (1 - 1e-9))))
    steps = intervals * substeps
    step = duration / steps
    # Compiled as a whole: operation by operation, JAX would compile every one of them.
    q, qd, _ = jax.jit(jax.vmap(lambda t: trajectory(t)))(jnp.linspace(0.0, duration, steps + 1))
    q, qd = np.array(q, dtype=float), np.array(qd, dtype=float)
    position = np.array(initial_state.base_position, dtype=float)
    quaternion = np.array(initial_state.base_quaternion, dtype=float)
    start = State(base_position=position, base_quaternion=quaternion, joint_position=q[0])
    velocity = initial_velocity(robot, start, qd[0], momentum)
    order = branch_order(robot.topology)
    q, qd = q[:, order], qd[:, order]
    return Drive(
        step=step,
        substeps=substeps,
        time=np.asarray(sample_time, dtype=float),
        joint_position=q,
        joint_velocity=qd,
        mean_acceleration=np.diff(qd, axis=0) / step,
        qpos=np.concatenate([position, quaternion, q[0]]),
        qvel=velocity,
        order=order,
    )


def initial_velocity(
    robot: Robot, start: State, joint_velocity: np.ndarray, momentum: np.ndarray
) -> np.ndarray:
    """Velocity (6 + n,) as MuJoCo orders it, of a robot that starts with this momentum (6,)."""
    twist = np.asarray(_initial_twist(robot, start, joint_velocity, momentum))
    # A free joint's linear velocity is resolved in I, its angular velocity in B.
    spin_B = np.asarray(quaternion_to_matrix(jnp.asarray(start.base_quaternion))).T @ twist[3:]
    return np.concatenate([twist[:3], spin_B, joint_velocity[branch_order(robot.topology)]])


@jax.jit
def _initial_twist(robot: Robot, start: State, joint_velocity, momentum):
    return base_twist(robot, kinematics(robot, start), joint_velocity, momentum)


def commanded_acceleration(step: Any, mean_acceleration: Any, position_error: Any, rate_error: Any) -> Any:
    """Joint acceleration (n,) to command over a step, from the errors (reference less actual) at its
    start.
    """
    return mean_acceleration + position_error / step**2 + 1.5 * rate_error / step


def joint_torque(xp: ModuleType, inertia: Any, bias: Any, joint_acceleration: Any) -> Any:
    """Joint torque (n,) for a joint acceleration (n,) with the base free.

    inertia (6 + n, 6 + n) and bias (6 + n,) are the engine's; xp is numpy or jax.numpy.
    """
    b = BASE_VELOCITIES
    base = -xp.linalg.solve(inertia[:b, :b], inertia[:b, b:] @ joint_acceleration + bias[:b])
    return inertia[b:, :b] @ base + inertia[b:, b:] @ joint_acceleration + bias[b:]


def body_momenta(mass, principal, com, axes, velocity, system_com) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum (about the system centre of mass) of each body, (..., b, 3) each.

    The arguments are an engine's data: mass (b,), principal moments (b, 3), centres of mass (..., b, 3),
    principal axes (..., b, 3, 3), velocity (..., b, 6) as MuJoCo's cvel, [angular; linear, of the body point
    at the system centre of mass], system_com (..., 3).
    """
    spin, lever = velocity[..., :3], com - system_com[..., None, :]
    linear = mass[:, None] * (velocity[..., 3:] + np.cross(spin, lever))
    spin_in_axes = np.einsum("...ji,...j->...i", axes, spin)
    own = np.einsum("...ij,...j->...i", axes, principal * spin_in_axes)
    return linear, own + np.cross(lever, linear)


def largest_shares(linear: np.ndarray, angular: np.ndarray) -> np.ndarray:
    """Largest magnitudes (2,) of any one body's linear and angular momentum."""
    return np.array([np.linalg.norm(x, axis=-1).max() for x in (linear, angular)])
