"""The loop that follows a joint motion in MJX: shared by one robot and by a batch of them.

Compiling costs more than running, because MJX unrolls the four stages of its Runge-Kutta step: 17 s against 1.5 s
for 30,000 steps of a six-joint arm. So the stages are a loop here, 7.5 s: the accelerations, the torque's inertia
matrix and the integration of positions (mjx.euler without acceleration is nothing else) are MJX's, and only the
four numbers of the classical method are ours. The torque, held over the step, is computed in the first stage. The
step length and the number of steps per sample are traced, not static, and the warm-up that compiles takes no
step. Only configuration and velocity travel in the loop.

MJX takes an angular velocity whose components are all under 1e-8 rad/s for zero, so a slow start or end
leaves about 1e-10 rad in the attitude that no shorter step removes.
"""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.crosscheck.drive import Drive, commanded_acceleration, joint_torque
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES
from jffsr.crosscheck.quiet import import_mjx

_REACH = np.array([0.0, 0.5, 0.5, 1.0])
_WEIGHT = np.array([1.0, 2.0, 2.0, 1.0]) / 6
_FIRST = np.array([True, False, False, False])


def references(drive: Drive, widest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """References (K, widest, n) of each step, padded so that every drive has the same shapes."""

    def padded(rows: np.ndarray) -> np.ndarray:
        rows = rows.reshape(-1, drive.substeps, rows.shape[-1])
        return np.pad(rows, ((0, 0), (0, widest - drive.substeps), (0, 0)))

    return (
        padded(drive.joint_position[:-1]),
        padded(drive.joint_velocity[:-1]),
        padded(drive.mean_acceleration),
    )


def follow(model: Any, blank: Any, step, substeps, qpos, qvel, references):
    """qpos (K + 1, 7 + n) and qvel (K + 1, 6 + n) at the samples, and the largest tracking error."""
    model = model.tree_replace({"opt.timestep": jnp.asarray(step)})

    def interval(carry, rows):
        def body(i, carry):
            return advance(model, blank, carry, tuple(row[i] for row in rows))

        carry = jax.lax.fori_loop(0, substeps, body, carry)
        return carry, carry[:2]

    (_, _, error), (positions, velocities) = jax.lax.scan(
        interval, (jnp.asarray(qpos), jnp.asarray(qvel), jnp.zeros(())), references
    )
    return jnp.vstack([qpos, positions]), jnp.vstack([qvel, velocities]), error


def advance(model: Any, blank: Any, carry, reference):
    """One step of the model's time step under one torque.

    carry is qpos (7 + n,), qvel (6 + n,) and the largest tracking error so far; reference is the joint
    position and rate wanted now, and the mean acceleration over the step, (n,) each.
    """
    mjx = import_mjx()
    qpos, qvel, error = carry
    position, rate, mean_acceleration = reference
    step = model.opt.timestep
    position_error = position - qpos[BASE_COORDINATES:]
    rate_error = rate - qvel[BASE_VELOCITIES:]
    wanted = commanded_acceleration(step, mean_acceleration, position_error, rate_error)
    still = jnp.zeros_like(qvel)

    def moved(velocity):
        return mjx.euler(model, blank.replace(qpos=qpos, qvel=velocity, qacc=still)).qpos

    def stage(carry, numbers):
        velocity, acceleration, mean_velocity, mean_rate, torque = carry
        reach, weight, first = numbers
        there = moved(reach * velocity)
        velocity = qvel + reach * step * acceleration
        data = blank.replace(qpos=there, qvel=velocity)
        data = mjx.fwd_velocity(model, mjx.fwd_position(model, data))
        torque = jax.lax.cond(
            first,
            lambda: joint_torque(jnp, mjx.full_m(model, data), data.qfrc_bias, wanted),
            lambda: torque,
        )
        data = mjx.fwd_acceleration(model, mjx.fwd_actuation(model, data.replace(ctrl=torque)))
        # Without constraints this is the acceleration that mjx.forward ends with.
        acceleration = data.qacc_smooth
        mean_velocity, mean_rate = mean_velocity + weight * velocity, mean_rate + weight * acceleration
        return (velocity, acceleration, mean_velocity, mean_rate, torque), None

    start = (still, still, still, still, jnp.zeros_like(position))
    (_, _, mean_velocity, mean_rate, _), _ = jax.lax.scan(stage, start, (_REACH, _WEIGHT, _FIRST))
    error = jnp.maximum(error, jnp.max(jnp.abs(position_error)))
    return moved(mean_velocity), qvel + step * mean_rate, error
