"""A joint motion followed in MJX, one compiled program for every step length.

Compiling costs more than running (23 to 46 s against 1 to 3 s for 30,000 steps of a six-joint arm), because
MJX unrolls the stages of its Runge-Kutta step and the levels of the tree. So the step length and the number
of steps per sample are traced, not static, and the warm-up that compiles takes no step. The stages of the
step are called one by one: the torque needs positions and velocities, which mjx.step would do again. Only
configuration and velocity travel in the loop; everything else is made from them within a step.

MJX takes an angular velocity whose components are all under 1e-8 rad/s for zero, so a slow start or end
leaves about 1e-10 rad in the attitude that no shorter step removes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.crosscheck.drive import (
    Drive,
    EngineMotion,
    body_momenta,
    check_x64,
    commanded_acceleration,
    joint_torque,
    largest_shares,
)
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, BASE_VELOCITIES, to_mjmodel
from jffsr.crosscheck.quiet import import_mjx
from jffsr.robots.robot import Robot


def run_mjx(robot: Robot, drives: Sequence[Drive]) -> list[EngineMotion]:
    """The motion in MJX for each drive; all must have the same sample times.

    After t = 0 only the motors' torques are written. The compile time stands with the first.
    """
    check_x64()
    mjx = import_mjx()
    # One long sequence of small steps: latency decides, and a CPU has less of it than any accelerator.
    with jax.default_device(jax.devices("cpu")[0]):
        model = to_mjmodel(robot, drives[0].step)
        mjx_model = mjx.put_model(model, impl="jax")
        blank = mjx.make_data(model, impl="jax")
        follow = jax.jit(lambda *arguments: _follow(mjx_model, blank, *arguments))
        # A map compiles in two thirds of the time of a vmap, and a hundred samples take no time.
        measure = jax.jit(
            lambda states: jax.lax.map(lambda state: _measure(mjx_model, blank, *state), states)
        )
        widest = max(drive.substeps for drive in drives)
        motions = []
        for drive in drives:
            references = _references(drive, widest)
            start = time.perf_counter()
            if not motions:
                still = follow(drive.step, 0, drive.qpos, drive.qvel, references)
                jax.block_until_ready(measure(still[:2]))
            compiled = time.perf_counter()
            qpos, qvel, error = jax.block_until_ready(
                follow(drive.step, drive.substeps, drive.qpos, drive.qvel, references)
            )
            done = time.perf_counter()
            measured = [np.asarray(x) for x in measure((qpos, qvel))]
            linear, angular = body_momenta(model.body_mass[1:], model.body_inertia[1:], *measured)
            qpos, last = np.asarray(qpos), np.asarray(qpos)[-1, BASE_COORDINATES:]
            motions.append(
                EngineMotion(
                    time=drive.time,
                    base_position=qpos[:, :3],
                    base_quaternion=qpos[:, 3:BASE_COORDINATES],
                    joint_position=qpos[:, BASE_COORDINATES:],
                    momentum=np.concatenate([linear.sum(axis=1), angular.sum(axis=1)], axis=-1),
                    momentum_share=largest_shares(linear, angular),
                    tracking_error=float(np.maximum(error, np.abs(drive.joint_position[-1] - last).max())),
                    compile_seconds=0.0 if motions else compiled - start,
                    run_seconds=done - compiled,
                )
            )
    return motions


def _references(drive: Drive, widest: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """References (K, widest, n) of each step, padded so that every drive has the same shapes."""

    def padded(rows: np.ndarray) -> np.ndarray:
        rows = rows.reshape(-1, drive.substeps, rows.shape[-1])
        return np.pad(rows, ((0, 0), (0, widest - drive.substeps), (0, 0)))

    return (
        padded(drive.joint_position[:-1]),
        padded(drive.joint_velocity[:-1]),
        padded(drive.mean_acceleration),
    )


def _follow(model: Any, blank: Any, step, substeps, qpos, qvel, references):
    """qpos (K + 1, 7 + n) and qvel (K + 1, 6 + n) at the samples, and the largest tracking error."""
    model = model.tree_replace({"opt.timestep": jnp.asarray(step)})

    def interval(carry, rows):
        def body(i, carry):
            return _step(model, blank, step, carry, tuple(row[i] for row in rows))

        carry = jax.lax.fori_loop(0, substeps, body, carry)
        return carry, carry[:2]

    (_, _, error), (positions, velocities) = jax.lax.scan(
        interval, (jnp.asarray(qpos), jnp.asarray(qvel), jnp.zeros(())), references
    )
    return jnp.vstack([qpos, positions]), jnp.vstack([qvel, velocities]), error


def _step(model: Any, blank: Any, step, carry, reference):
    """One step of MJX, in MJX's own stages, with the torque set as soon as its inputs are known."""
    mjx = import_mjx()
    qpos, qvel, error = carry
    position, rate, mean_acceleration = reference
    data = mjx.fwd_velocity(model, mjx.fwd_position(model, blank.replace(qpos=qpos, qvel=qvel)))
    position_error = position - qpos[BASE_COORDINATES:]
    rate_error = rate - qvel[BASE_VELOCITIES:]
    wanted = commanded_acceleration(step, mean_acceleration, position_error, rate_error)
    data = data.replace(ctrl=joint_torque(jnp, mjx.full_m(model, data), data.qfrc_bias, wanted))
    data = mjx.fwd_acceleration(model, mjx.fwd_actuation(model, data))
    # Without constraints this is all that mjx.forward does.
    data = mjx.rungekutta4(model, data.replace(qacc=data.qacc_smooth))
    return data.qpos, data.qvel, jnp.maximum(error, jnp.max(jnp.abs(position_error)))


def _measure(model: Any, blank: Any, qpos, qvel):
    """What the momentum of every body needs, from MJX's own positions and velocities."""
    mjx = import_mjx()
    data = mjx.com_vel(model, mjx.com_pos(model, mjx.kinematics(model, blank.replace(qpos=qpos, qvel=qvel))))
    return data.xipos[1:], data.ximat[1:], data.cvel[1:], data.subtree_com[1]
