"""A joint motion followed in MJX, one compiled program for every step length."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from jffsr.crosscheck.drive import (
    Drive,
    EngineMotion,
    body_momenta,
    check_x64,
    largest_shares,
)
from jffsr.crosscheck.mjx_follow import follow, references
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, to_mjmodel
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
        run = jax.jit(lambda *arguments: follow(mjx_model, blank, *arguments))
        # A map compiles in two thirds of the time of a vmap, and a hundred samples take no time.
        measure = jax.jit(
            lambda states: jax.lax.map(lambda state: _measure(mjx_model, blank, *state), states)
        )
        widest = max(drive.substeps for drive in drives)
        motions = []
        for drive in drives:
            rows = references(drive, widest)
            start = time.perf_counter()
            if not motions:
                still = run(drive.step, 0, drive.qpos, drive.qvel, rows)
                jax.block_until_ready(measure(still[:2]))
            compiled = time.perf_counter()
            qpos, qvel, error = jax.block_until_ready(
                run(drive.step, drive.substeps, drive.qpos, drive.qvel, rows)
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
                    joint_position=drive.robot_order(qpos[:, BASE_COORDINATES:]),
                    momentum=np.concatenate([linear.sum(axis=1), angular.sum(axis=1)], axis=-1),
                    momentum_share=largest_shares(linear, angular),
                    tracking_error=float(np.maximum(error, np.abs(drive.joint_position[-1] - last).max())),
                    compile_seconds=0.0 if motions else compiled - start,
                    run_seconds=done - compiled,
                )
            )
    return motions


def _measure(model: Any, blank: Any, qpos, qvel):
    """What the momentum of every body needs, from MJX's own positions and velocities."""
    mjx = import_mjx()
    data = mjx.com_vel(model, mjx.com_pos(model, mjx.kinematics(model, blank.replace(qpos=qpos, qvel=qvel))))
    return data.xipos[1:], data.ximat[1:], data.cvel[1:], data.subtree_com[1]
