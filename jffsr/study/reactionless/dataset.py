"""Holds as labelled arrays: one closed loop over time, and what many runs and seeds came to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.study.dataset import of
from jffsr.study.reactionless.holding import Held

_SECOND = {"revolute": "rad", "prismatic": "m"}
_EFFORT = {"revolute": "N m", "prismatic": "N"}


def hold_dataset(robot: Robot, held: Held, begin: float = 0.0):
    """An xarray Dataset of one closed loop, by a clock at which it begins at `begin`, s."""
    import xarray

    attributes = {"code": int(held.run.code), "sentence": held.run.sentence}
    variables = hold_variables(robot, held)
    return xarray.Dataset(variables, coords=coordinates(robot, held.run.time + begin), attrs=attributes)


def runs_dataset(robot: Robot, runs: Mapping[str, Sequence[Held]]):
    """An xarray Dataset of the first seed of every run over time, and of what every seed came to."""
    import xarray

    parts = [hold_variables(robot, helds[0]) for helds in runs.values()]
    first = next(iter(runs.values()))[0]
    variables = {
        name: (("run", *dims), np.stack([part[name][1] for part in parts]), attributes)
        for name, (dims, _, attributes) in parts[0].items()
    }

    def each(values, units: str, meaning: str):
        return of(
            ("run", "seed"), [[values(held) for held in helds] for helds in runs.values()], units, meaning
        )

    unit = _unit(robot, _SECOND)
    variables |= {
        "settled_base_rate": each(lambda h: h.base_rate, "rad/s", "root mean square over the last stretch"),
        "turned": each(lambda h: h.turned, "rad", "base attitude between start and end"),
        "code": each(lambda h: int(h.run.code), "1", "of the loop"),
        "mean_error": each(lambda h: h.run.error.mean(), unit, "joint position error, signed, all joints"),
        "rms_error": each(lambda h: np.sqrt(np.mean(h.run.error**2)), unit, "joint position error"),
        "peak_error": each(lambda h: np.abs(h.run.error).max(), unit, "joint position error"),
    }
    places = coordinates(robot, first.run.time) | {"run": ("run", list(runs))}
    return xarray.Dataset(variables, coords=places)


def hold_variables(robot: Robot, held: Held) -> dict:
    """Variables of one closed loop over `time`."""
    run, unit, joints = held.run, _unit(robot, _SECOND), ("time", "joint")
    return {
        **motion_variables(robot, run.states, run.torque),
        "desired_position": of(joints, run.desired_position, unit, "joint position to follow"),
        "desired_velocity": of(joints, run.desired_velocity, f"{unit}/s", "joint rate to follow"),
        "disturbance": of(joints, run.disturbance, _unit(robot, _EFFORT), "unknown joint torque"),
        "torque_limited": of(joints, run.limited, "1", "whether the torque limit acted"),
        "momentum": of(
            ("time", "twist"), run.momentum, "N s, N m s", "linear, angular about the centre of mass"
        ),
    }


def motion_variables(robot: Robot, states: State, torque: np.ndarray) -> dict:
    """Variables of states (N, ...) and motor torques (N, n) over `time`."""
    unit, joints = _unit(robot, _SECOND), ("time", "joint")
    axes, component = ("time", "axis"), ("time", "component")
    return {
        "base_position": of(axes, states.base_position, "m", "base centre of mass, inertial frame"),
        "base_quaternion": of(component, states.base_quaternion, "1", "base to inertial frame"),
        "base_twist": of(("time", "twist"), states.base_twist, "m/s, rad/s", "base twist, inertial frame"),
        "joint_position": of(joints, states.joint_position, unit, "joint position"),
        "joint_velocity": of(joints, states.joint_velocity, f"{unit}/s", "joint rate"),
        "joint_torque": of(joints, torque, _unit(robot, _EFFORT), "motor torque"),
    }


def coordinates(robot: Robot, time: np.ndarray) -> dict:
    """Coordinates of these variables."""
    return {
        "time": ("time", np.asarray(time), {"units": "s"}),
        "joint": ("joint", list(robot.joint_names)),
        "axis": ("axis", ["x", "y", "z"]),
        "component": ("component", ["w", "x", "y", "z"]),
        "twist": ("twist", ["vx", "vy", "vz", "wx", "wy", "wz"]),
    }


def _unit(robot: Robot, units: dict[str, str]) -> str:
    return "/".join(sorted({units[kind] for kind in robot.topology.joint_types}))
