"""A plan as labelled arrays: what result.nc holds."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np

from jffsr.compiling import Program
from jffsr.objectives.clearance import Clearance
from jffsr.objectives.terms import ROTATION_VECTOR, AttitudeExcursion, attitude_angles
from jffsr.optimizers.constraints import split
from jffsr.planning.plan import Plan
from jffsr.planning.problem import Problem
from jffsr.writing import write_atomically

_attitude_angles = Program(attitude_angles, static_argnums=1, once=True)
_SECOND = {"revolute": "rad", "prismatic": "m"}
_EFFORT = {"revolute": "N m", "prismatic": "N"}


def excursion_limit(problem: Problem) -> tuple[np.ndarray, str]:
    """How far the base may turn about each axis, (3,), rad, infinite without a limit, and how its turn is measured."""
    for term in problem.objective.terms:
        if isinstance(term, AttitudeExcursion):
            return np.asarray(term.limit), term.measure
    return np.full(3, np.inf), ROTATION_VECTOR


def plan_dataset(plan: Plan, name: str, phase_names: list[str]):
    """An xarray Dataset of a plan: motion, limits, the search's history and the free numbers, with units."""
    import xarray

    motion, robot = plan.motion, plan.problem.robot
    history = np.array(plan.history, dtype=float).reshape(-1, 5)
    best, missed = history[:, 4], {}
    if plan.problem.constraints:
        best, violation = split(best, plan.free.dtype)
        meaning = "violation of the constraints by the best so far"
        missed["history_violation"] = ("iteration", violation, {"units": "1", "long_name": meaning})
    unit = "/".join(sorted({_SECOND[kind] for kind in robot.topology.joint_types}))
    excursion, measure = excursion_limit(plan.problem)
    limits = robot.limits

    apart, pairs, margin = {}, {}, {}
    for constraint in plan.problem.constraints:
        if isinstance(constraint, Clearance):
            distances = constraint.distances(robot, motion)
            apart["clearance"] = of(("pair", "time"), distances, "m", "signed distance of two bodies")
            pairs["pair"] = ("pair", [" and ".join(pair) for pair in constraint.model.pair_names])
            margin["margin"] = float(np.asarray(constraint.margin))
    torque = {}
    if motion.joint_torque is not None:
        force = "/".join(sorted({_EFFORT[kind] for kind in robot.topology.joint_types}))
        torque = {
            "joint_torque": of(("time", "joint"), motion.joint_torque, force, "joint torque"),
            "joint_torque_limit": of("joint", limits.torque, force, "torque limit"),
        }
    return xarray.Dataset(
        {
            "joint_position": of(("time", "joint"), motion.joint_position, unit, "joint position"),
            "joint_velocity": of(("time", "joint"), motion.joint_velocity, f"{unit}/s", "joint rate"),
            "joint_acceleration": of(
                ("time", "joint"), motion.joint_acceleration, f"{unit}/s^2", "joint acceleration"
            ),
            **torque,
            "base_position": of(
                ("time", "axis"), motion.base_position, "m", "base centre of mass, inertial frame"
            ),
            "base_quaternion": of(
                ("time", "component"), motion.base_quaternion, "1", "base to inertial frame"
            ),
            "base_twist": of(
                ("time", "twist"), motion.base_twist, "m/s, rad/s", "base twist, inertial frame"
            ),
            "attitude_angle": of(
                ("time", "axis"),
                _attitude_angles(motion, measure),
                "rad",
                f"base attitude relative to its start ({measure})",
            ),
            "momentum": of(
                "twist", motion.momentum, "N s, N m s", "linear, angular about the centre of mass"
            ),
            "joint_position_lower": of("joint", limits.position_lower, unit, "lower position limit"),
            "joint_position_upper": of("joint", limits.position_upper, unit, "upper position limit"),
            "joint_velocity_limit": of("joint", limits.velocity, f"{unit}/s", "rate limit"),
            "joint_acceleration_limit": of("joint", limits.acceleration, f"{unit}/s^2", "acceleration limit"),
            "excursion_limit": of("axis", excursion, "rad", "base attitude excursion limit"),
            "history_phase": of("iteration", history[:, 0].astype(int), "1", "phase of the search"),
            "history_evaluations": of("iteration", history[:, 2].astype(int), "1", "objective evaluations"),
            "history_gradient_evaluations": of(
                "iteration", history[:, 3].astype(int), "1", "gradient evaluations"
            ),
            "history_best_value": of("iteration", best, "1", "best index so far"),
            "free_numbers": of("free", plan.free, "1", "free numbers of the trajectory"),
            **missed,
            **apart,
        },
        coords={
            "time": ("time", np.asarray(motion.time), {"units": "s"}),
            "joint": ("joint", list(robot.joint_names)),
            "axis": ("axis", ["x", "y", "z"]),
            "component": ("component", ["w", "x", "y", "z"]),
            "twist": ("twist", ["vx", "vy", "vz", "wx", "wy", "wz"]),
            **pairs,
        },
        attrs={
            "name": name,
            "robot": robot.name,
            "phase_names": json.dumps(phase_names),
            "accuracy": float(plan.problem.objective.accuracy),
            "index": float(plan.cost),
            **margin,
        },
    )


def of(dims, values, units: str, meaning: str):
    """A variable with its dimension, or a tuple of them, its units and what it is."""
    dims = dims if isinstance(dims, tuple) else (dims,)
    return dims, np.asarray(values), {"units": units, "long_name": meaning}


def save_dataset(dataset, path: Path, encoding: dict | None = None) -> None:
    """Write a Dataset as netCDF-4 atomically; encoding is xarray's. Raises OSError where there is no room for it."""
    # HDF5 may end the process where the disk is full, so it writes to memory first.
    buffer = io.BytesIO()
    dataset.to_netcdf(buffer, engine="h5netcdf", encoding=encoding or {})

    def write(part: Path) -> None:
        part.write_bytes(buffer.getbuffer())

    write_atomically(path, write)


def open_dataset(path: Path):
    """Read a Dataset written by `save_dataset` into memory."""
    import xarray

    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        return dataset.load()
