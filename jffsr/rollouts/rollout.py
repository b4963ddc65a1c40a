"""Base motion along a prescribed joint trajectory under zero or given momentum."""

from __future__ import annotations

from numbers import Integral

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING, base_freedom
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.hot_path import hot_joint_terms
from jffsr.rollouts.joint_terms import JointTerms
from jffsr.rollouts.kernels import FAST, PLAIN, check_kernel
from jffsr.rollouts.motion import JointGrid, Motion, sample_joints
from jffsr.rollouts.plain_path import plain_joint_terms
from jffsr.spatial.components import (
    add,
    cross,
    quaternion_rows,
    rows_times,
    rows_transposed_times,
    subtract,
    symmetric_times,
)
from jffsr.trajectories.interface import Trajectory
from jffsr.types import Array, Scalar, Twist

_JOINT_TERMS = {FAST: hot_joint_terms, PLAIN: plain_joint_terms}


def rollout(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    duration: Scalar | float | None = None,
    num_steps: int = 200,
    momentum: Twist | None = None,
    base_mode: str = FLOATING,
    kernel: str = FAST,
) -> Motion:
    """Motion of the robot while its joints follow the trajectory and no external force acts.

    The attitude is integrated by classical Runge-Kutta of order 4 with `num_steps` equal steps (static);
    the base position follows from the straight line of the system centre of mass. `momentum` (6,) is P,
    N s, then L about the system centre of mass, N m s, in I; None means zero. `duration`, s, defaults to the
    trajectory's own. Of the initial state only the base pose is read: the joints are the trajectory's.
    base_mode (static) is floating; attitude_held, where only P is conserved and L is not used; or fixed, where
    the base stands still whatever the momentum. kernel (static) is fast, or plain for the textbook's evaluation
    of the inertias, which gives the same and takes some twenty times as long. Raises InputError for another base_mode
    or kernel, for num_steps that is no positive whole number, and for want of a duration.
    """
    grid = sample_joints(trajectory, check_duration(trajectory, duration), check_steps(num_steps))
    return rollout_grid(robot, grid, initial_state, momentum, base_mode, kernel)


def check_duration(trajectory: Trajectory, duration: Scalar | float | None) -> Scalar | float:
    """The duration given, else the trajectory's own; InputError if there is neither."""
    duration = getattr(trajectory, "duration", None) if duration is None else duration
    if duration is None:
        raise InputError("the trajectory has no duration of its own: pass duration=, in seconds")
    return duration


def check_steps(num_steps: int) -> int:
    """The number of steps, if it is a positive whole number."""
    # numpy's integers are not Python's, but both register as Integral; so does bool.
    if not isinstance(num_steps, Integral) or isinstance(num_steps, bool) or num_steps < 1:
        raise InputError(f"num_steps is {num_steps!r}; a positive whole number is expected")
    return int(num_steps)


def rollout_grid(
    robot: Robot,
    grid: JointGrid,
    initial_state: State,
    momentum: Twist | None = None,
    base_mode: str = FLOATING,
    kernel: str = FAST,
) -> Motion:
    """The same for joint motion already sampled on 2N + 1 points."""
    freedom, joint_terms = base_freedom(base_mode), _JOINT_TERMS[check_kernel(kernel)]
    momentum = jnp.zeros(6) if momentum is None else jnp.asarray(momentum)
    if freedom == 0:
        position, quaternion, twist = _still(initial_state, grid)
    else:
        terms = joint_terms(robot, grid.joint_position, grid.joint_velocity)
        total = jnp.sum(jnp.asarray(robot.mass))
        position, quaternion, twist = _free(terms, total, grid, initial_state, momentum, freedom == 6)
    return Motion(
        time=grid.time[::2],
        base_position=position,
        base_quaternion=quaternion,
        base_twist=twist,
        joint_position=grid.joint_position[::2],
        joint_velocity=grid.joint_velocity[::2],
        joint_acceleration=grid.joint_acceleration[::2],
        momentum=momentum,
        joint_grid=grid,
        base_mode=base_mode,
    )


def _still(initial_state: State, grid: JointGrid) -> tuple[Array, Array, Array]:
    """Base position (N + 1, 3), quaternion (N + 1, 4) and twist (N + 1, 6) of a base that never moves."""
    samples = len(grid.time[::2])
    position, quaternion = (
        jnp.asarray(initial_state.base_position),
        jnp.asarray(initial_state.base_quaternion),
    )
    return (
        jnp.broadcast_to(position, (samples, 3)),
        jnp.broadcast_to(quaternion, (samples, 4)),
        jnp.zeros((samples, 6)),
    )


def _free(
    terms: JointTerms, total: Scalar, grid: JointGrid, initial_state: State, momentum: Twist, turning: bool
) -> tuple[Array, Array, Array]:
    """The same for a base that gives way, and turns or keeps its attitude."""
    initial = jnp.asarray(initial_state.base_quaternion)
    samples = jax.tree.map(lambda x: x[::2], terms)
    time = grid.time[::2]
    if turning:
        components = _integrate_attitude(terms, grid.time[2] - grid.time[0], initial, momentum[3:])
        rotation = quaternion_rows(components)
        omega_B = samples.base_rate(rows_transposed_times(rotation, tuple(momentum[3:])))
    else:
        components = tuple(jnp.broadcast_to(part, time.shape) for part in initial)
        rotation = quaternion_rows(components)
        omega_B = (jnp.zeros_like(time),) * 3

    drift = tuple(momentum[:3] / total)
    offset = rows_times(rotation, samples.com)
    start = jnp.asarray(initial_state.base_position)
    position = tuple(start[k] + offset[k][0] + drift[k] * time - offset[k] for k in range(3))
    swing = rows_times(rotation, add(cross(omega_B, samples.com), samples.com_velocity))
    velocity = subtract(drift, swing)
    return (
        jnp.stack(position, axis=-1),
        jnp.stack(components, axis=-1),
        jnp.stack([*velocity, *rows_times(rotation, omega_B)], axis=-1),
    )


def _integrate_attitude(
    terms: JointTerms, step: Scalar, initial: Array, angular_momentum: Array
) -> tuple[Array, Array, Array, Array]:
    """Base quaternions, four components (N + 1,), by classical Runge-Kutta.

    Each step is brought back to unit length, which leaves the order at 4.
    """
    momentum = tuple(angular_momentum)
    # Without barriers the compiler computes each stage again for each component of the next: a step took 1.7 times
    # as long, its gradient 11 times.
    barrier = jax.lax.optimization_barrier

    def rate(stage: tuple[Array, ...], q):
        w, x, y, z = q
        spin = symmetric_times(stage[:6], rows_transposed_times(quaternion_rows(q), momentum))
        ox, oy, oz = barrier(subtract(spin, stage[6:]))
        return (
            0.5 * (-x * ox - y * oy - z * oz),
            0.5 * (w * ox + y * oz - z * oy),
            0.5 * (w * oy + z * ox - x * oz),
            0.5 * (w * oz + x * oy - y * ox),
        )

    def moved(q, k, by):
        return barrier(tuple(a + by * b for a, b in zip(q, k, strict=True)))

    def advance(q, stages):
        first, middle, last = stages
        k1 = rate(first, q)
        k2 = rate(middle, moved(q, k1, step / 2))
        k3 = rate(middle, moved(q, k2, step / 2))
        k4 = rate(last, moved(q, k3, step))
        slope = tuple(a + 2 * b + 2 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        q = moved(q, slope, step / 6)
        length = jnp.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
        q = tuple(a / length for a in q)
        return q, q

    # Array by array: a batch of rollouts is then beside each other in memory at each step, as the loop reads it.
    # Packed in one array, its numbers were gathered one by one.
    sampled = (*terms.inverse_inertia, *terms.joint_rate)
    stages = barrier(
        tuple(tuple(x[part] for x in sampled) for part in (np.s_[:-1:2], np.s_[1::2], np.s_[2::2]))
    )
    start = tuple(initial)
    _, later = jax.lax.scan(advance, start, stages)
    return tuple(jnp.concatenate([a[None], b]) for a, b in zip(start, later, strict=True))
