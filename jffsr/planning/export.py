"""A motion as tables for other tools: CSV, MATLAB, and joint positions at equal times."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import SAMPLED, Motion
from jffsr.trajectories.interface import Trajectory


def joint_table(trajectory: Trajectory, duration: float, period: float) -> dict[str, np.ndarray]:
    """Joint motion every `period` s, as a controller wants it.

    time (K,), joint_position, joint_velocity and joint_acceleration (K, n); the last sample is the end of the
    motion, also where it is not a whole number of periods away.
    """
    if not (np.isfinite(period) and 0 < period <= duration):
        raise InputError(f"period is {period:g} s; a number in (0, {duration:g}] is expected")
    time = np.arange(0.0, duration, period)
    if duration - time[-1] < 1e-9 * duration:
        time = time[:-1]
    time = np.append(time, duration)
    position, velocity, acceleration = jax.device_get(jax.vmap(trajectory)(jnp.asarray(time)))
    return {
        "time": time,
        "joint_position": position,
        "joint_velocity": velocity,
        "joint_acceleration": acceleration,
    }


def to_csv(robot: Robot, motion: Motion, path: str | os.PathLike[str]) -> None:
    """The motion as CSV, a row a sample: time, base position, base quaternion, joint positions and rates.

    Units are in the head of each column.
    """
    units = {"revolute": "rad", "prismatic": "m"}
    of = [units[kind] for kind in robot.topology.joint_types]
    head = ["time [s]", *(f"base_{axis} [m]" for axis in "xyz"), *(f"base_q{part}" for part in "wxyz")]
    head += [f"{name} [{unit}]" for name, unit in zip(robot.joint_names, of, strict=True)]
    head += [f"{name} rate [{unit}/s]" for name, unit in zip(robot.joint_names, of, strict=True)]
    columns = (
        motion.time[:, None],
        motion.base_position,
        motion.base_quaternion,
        motion.joint_position,
        motion.joint_velocity,
    )
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows([repr(float(x)) for x in row] for row in np.concatenate(columns, axis=1))


def to_mat(robot: Robot, motion: Motion, cost: float, path: str | os.PathLike[str]) -> None:
    """The motion as a MATLAB 5 file: arrays under the names of Motion's fields, and joint_names."""
    from scipy.io import savemat

    values = {name: np.asarray(getattr(motion, name)) for name in (*SAMPLED, "momentum")}
    values["joint_names"] = np.array(robot.joint_names, dtype=object)
    values["index"] = float(cost)
    savemat(Path(path), values)
