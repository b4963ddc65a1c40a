"""A chain as labelled arrays: what the camera saw, the approach, the hold, and one time line of all that moved."""

from __future__ import annotations

import numpy as np

from jffsr.capture.mujoco_approach import Approach
from jffsr.robots.robot import Robot
from jffsr.study.capture.observing import ObservedTarget
from jffsr.study.chain.carried_out import Chain
from jffsr.study.dataset import of
from jffsr.study.reactionless.dataset import coordinates, hold_dataset, motion_variables
from jffsr.target.target_state import TargetState

APPROACH, HOLD = 0, 1


def observation_dataset(observed: ObservedTarget):
    """An xarray Dataset of the poses that were measured, and of the filter's estimate after each."""
    import xarray

    poses, course = observed.measurements, observed.course
    estimate, began = course.estimate, observed.started
    deviation = np.sqrt(np.diagonal(estimate.covariance, axis1=-2, axis2=-1))
    axes, component = ("time", "axis"), ("time", "component")
    filtered, filtered_component = ("filter_time", "axis"), ("filter_time", "component")
    variables = {
        "measured_position": of(axes, poses.position, "m", "marker, inertial frame"),
        "measured_quaternion": of(component, poses.quaternion, "1", "marker to inertial frame"),
        "seen": of("time", poses.seen, "1", "whether the exposure gave a pose"),
        "marker_position": of(filtered, estimate.marker_position, "m", "estimated marker, inertial frame"),
        "marker_velocity": of(filtered, estimate.marker_velocity, "m/s", "estimated, inertial frame"),
        "quaternion": of(filtered_component, estimate.quaternion, "1", "estimated marker axes to inertial"),
        "angular_velocity": of(filtered, estimate.angular_velocity_T, "rad/s", "estimated, marker's axes"),
        "inertia_ratios": of(filtered, estimate.inertia_ratios, "1", "estimated, shares of the largest"),
        "deviation": of(
            ("filter_time", "error"),
            deviation,
            "rad, rad/s, 1, m, m/s, m",
            "standard deviations, by the filter",
        ),
        "used": of("filter_time", course.used, "1", "whether the pose corrected the estimate"),
        "surprise": of(
            "filter_time", course.normalised_innovation_squared, "1", "normalised innovation squared"
        ),
    }
    times = {
        "time": ("time", np.asarray(poses.time) + began, {"units": "s", "long_name": "robot's time"}),
        "filter_time": ("filter_time", np.asarray(estimate.time) + began, {"units": "s"}),
        "axis": ("axis", ["x", "y", "z"]),
        "component": ("component", ["w", "x", "y", "z"]),
    }
    return xarray.Dataset(variables, coords=times)


def approach_dataset(robot: Robot, found: Approach):
    """An xarray Dataset of what MuJoCo made of the plan."""
    import xarray

    torque = np.concatenate([found.joint_torque, found.joint_torque[-1:]])
    variables = {**motion_variables(robot, found.states, torque), **_target(found.target_states)}
    attributes = {"tracking": found.tracking, "touched": "; ".join(map(str, found.contacts))}
    return xarray.Dataset(variables, coords=coordinates(robot, found.time), attrs=attributes)


def chain_dataset(robot: Robot, chain: Chain):
    """An xarray Dataset of approach and hold one after the other; of no sample where nothing was carried out."""
    import xarray

    parts = []
    if chain.approach is not None:
        approached = approach_dataset(robot, chain.approach)
        parts.append(approached.drop_vars([name for name in approached if str(name).startswith("target_")]))
    if chain.held is not None:
        held = hold_dataset(robot, chain.held, float(chain.approach.time[-1]))
        parts.append(held[list(parts[0].data_vars)])
    if not parts:
        return xarray.Dataset(coords={"time": ("time", np.zeros(0), {"units": "s"})})
    stage = np.repeat([APPROACH, HOLD][: len(parts)], [part.sizes["time"] for part in parts])
    found = xarray.concat(parts, dim="time", combine_attrs="drop", join="override")
    found["stage"] = of("time", stage, "1", "0 the approach, 1 the hold")
    return found


def _target(states: TargetState) -> dict:
    axes = ("time", "axis")
    return {
        "target_position": of(axes, states.position, "m", "target's centre of mass, inertial frame"),
        "target_quaternion": of(("time", "component"), states.quaternion, "1", "target to inertial frame"),
        "target_velocity": of(axes, states.velocity, "m/s", "target's centre of mass, inertial frame"),
        "target_angular_velocity": of(axes, states.angular_velocity_T, "rad/s", "target's axes"),
    }
