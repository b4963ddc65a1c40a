"""A capture as labelled arrays: what result.nc of a capture study holds."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import jax
import numpy as np

from jffsr.capture.front import CaptureFront
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.plan import CapturePlan
from jffsr.capture.tool_motion import ToolSamples, tool_samples
from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.objectives.terms import ROTATION_VECTOR, attitude_angles
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.study.capture.building import CaptureStudy, build_clearance
from jffsr.study.capture.planned import PlannedCapture
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.dataset import of
from jffsr.target.target_state import TargetState
from jffsr.types import Array

_SECOND = {"revolute": "rad", "prismatic": "m"}
ERRORS = ("x", "y", "z", "about_x", "about_y", "about_z", "vx", "vy", "vz", "wx", "wy", "wz")


class _Followed(NamedTuple):
    tool: ToolSamples
    target: TargetState
    grasp: tuple[Array, Array, Array]
    error: Array
    angles: Array


def capture_dataset(config: CaptureConfig, study: CaptureStudy, found: PlannedCapture):
    """An xarray Dataset of the criterion, and where there is a plan of its motion, tool, target and clearance."""
    import xarray

    variables, coordinates = _criterion(found)
    if found.plan is not None and found.plan.motion is not None:
        more, places = _motion(config, study, found, found.plan)
        variables, coordinates = variables | more, coordinates | places
    if found.front is not None:
        variables |= front_variables(found.front)
        coordinates["index"] = ("index", list(found.front.names))
    return xarray.Dataset(variables, coords=coordinates, attrs=_attributes(config, study, found))


def solution_dataset(config: CaptureConfig, study: CaptureStudy, found: PlannedCapture, plan: CapturePlan):
    """The Dataset of one solution of the front: the same as the plan's, without the criterion."""
    import xarray

    if found.observed is not None:
        prediction = found.observed.prediction(study.target, found.grasp, plan.duration)
        found = replace(found, prediction=prediction)
    variables, coordinates = _motion(config, study, found, plan)
    return xarray.Dataset(variables, coords=coordinates, attrs=_attributes(config, study, found))


def _attributes(config: CaptureConfig, study: CaptureStudy, found: PlannedCapture) -> dict[str, Any]:
    return {
        "name": config.name,
        "robot": study.robot.name,
        "end_effector": study.end_effector,
        "grasp": found.grasp,
        "grasp_time_code": int(found.chosen.code),
        "grasp_time_sentence": found.chosen.sentence,
        **({} if found.time is None else {"criterion_time": found.time}),
        **({} if config.planner.margin is None else {"margin": config.planner.margin}),
    }


def _criterion(found: PlannedCapture) -> tuple[dict, dict]:
    """The curves of `GraspTime`, by the robot's time."""
    scans, candidates = found.chosen.scans, found.chosen.candidates
    names = [scan.grasp for scan in scans]

    def each(name: str, units: str, meaning: str):
        values = np.stack([getattr(scan, name) for scan in scans])
        return of(("grasp", "scan_time"), values, units, meaning)

    variables = {
        "criterion": each("value", "m", "(2 |rho| - n_x' rho)/(1 + D)"),
        "grasp_distance": each("distance", "m", "from the tool's start to the grasp point"),
        "grasp_facing": each("facing", "1", "cosine between the way there and the approach axis"),
        "grasp_share": each("share", "1", "capability map's value at the grasp point"),
        "grasp_near": each("near", "1", "whether the map holds the grasp point"),
        "grasp_feasible": each("feasible", "1", "near, and the approach axis points away from the tool"),
        "candidate_grasp": of("candidate", [names.index(c.grasp) for c in candidates], "1", "which frame"),
        "candidate_time": of("candidate", [c.time - found.age for c in candidates], "s", "local minimum"),
        "candidate_value": of("candidate", [c.value for c in candidates], "m", "criterion there"),
        "candidate_share": of("candidate", [c.share for c in candidates], "1", "map's value there"),
        "candidate_chosen": of("candidate", [c == found.chosen.candidate for c in candidates], "1", "chosen"),
    }
    time = ("scan_time", scans[0].time - found.age, {"units": "s"})
    return variables, {"grasp": ("grasp", names), "scan_time": time}


@program(static_argnums=3, once=True)
def _followed(robot: Robot, motion: Motion, path: GraspPath, end_effector: str) -> _Followed:
    """Tool, target and grasp frame at every sample, and the tool's errors (N + 1, 12) to the grasp frame."""
    tool = tool_samples(robot, motion, end_effector)
    duration = motion.time[-1]
    states = jax.vmap(lambda t: path.target_state(t, duration))(motion.time)
    position, quaternion, twist = jax.vmap(lambda t: path.frame(t, duration))(motion.time)

    def turned(q_tool: Array, q_grasp: Array) -> Array:
        return quaternion_to_rotation_vector(quaternion_multiply(quaternion_conjugate(q_grasp), q_tool))

    turn = jax.vmap(turned)(tool.quaternion, quaternion)
    error = jax.numpy.concatenate([tool.position - position, turn, tool.twist - twist], axis=1)
    angles = attitude_angles(motion, ROTATION_VECTOR)
    return _Followed(tool, states, (position, quaternion, twist), error, angles)


def _motion(config, study: CaptureStudy, found: PlannedCapture, plan: CapturePlan) -> tuple[dict, dict]:
    motion, robot, limits = plan.motion, study.robot, study.robot.limits
    unit = "/".join(sorted({_SECOND[kind] for kind in robot.topology.joint_types}))
    seen = jax.device_get(_followed(robot, motion, found.path, study.end_effector))
    position, quaternion, twist = seen.grasp
    joints, axes, component = ("time", "joint"), ("time", "axis"), ("time", "component")
    variables = {
        "joint_position": of(joints, motion.joint_position, unit, "joint position"),
        "joint_velocity": of(joints, motion.joint_velocity, f"{unit}/s", "joint rate"),
        "joint_acceleration": of(joints, motion.joint_acceleration, f"{unit}/s^2", "joint acceleration"),
        "base_position": of(axes, motion.base_position, "m", "base centre of mass, inertial frame"),
        "base_quaternion": of(component, motion.base_quaternion, "1", "base to inertial frame"),
        "base_twist": of(("time", "twist"), motion.base_twist, "m/s, rad/s", "base twist, inertial frame"),
        "attitude_angle": of(
            axes, seen.angles, "rad", f"base attitude relative to its start ({ROTATION_VECTOR})"
        ),
        "tool_position": of(axes, seen.tool.position, "m", "tool, inertial frame"),
        "tool_quaternion": of(component, seen.tool.quaternion, "1", "tool to inertial frame"),
        "tool_twist": of(("time", "twist"), seen.tool.twist, "m/s, rad/s", "tool, inertial frame"),
        "grasp_position": of(axes, position, "m", "grasp frame, inertial frame"),
        "grasp_quaternion": of(component, quaternion, "1", "grasp to inertial frame"),
        "grasp_twist": of(("time", "twist"), twist, "m/s, rad/s", "grasp frame, inertial frame"),
        "grasp_error": of(
            ("time", "error"), seen.error, "m, rad, m/s, rad/s", "tool less grasp frame; rotation vector"
        ),
        **_target(seen.target),
        "momentum": of("twist", study.momentum, "N s, N m s", "linear, angular about the centre of mass"),
        "joint_position_lower": of("joint", limits.position_lower, unit, "lower position limit"),
        "joint_position_upper": of("joint", limits.position_upper, unit, "upper position limit"),
        "joint_velocity_limit": of("joint", limits.velocity, f"{unit}/s", "rate limit"),
        "joint_acceleration_limit": of("joint", limits.acceleration, f"{unit}/s^2", "acceleration limit"),
        "excursion_limit": of("axis", np.full(3, np.inf), "rad", "base attitude excursion limit"),
        "free_numbers": of("free", plan.free, "1", "free numbers of the trajectory"),
    }
    coordinates = {
        "time": ("time", np.asarray(motion.time), {"units": "s"}),
        "joint": ("joint", list(robot.joint_names)),
        "axis": ("axis", ["x", "y", "z"]),
        "component": ("component", ["w", "x", "y", "z"]),
        "twist": ("twist", ["vx", "vy", "vz", "wx", "wy", "wz"]),
        "error": ("error", list(ERRORS)),
    }
    geometry = study.geometry if found.observed is None else found.observed.geometry
    model = build_clearance(config, study, geometry)
    if model is not None:
        apart = distances(model, robot, motion, seen.target)
        variables["clearance"] = of(("pair", "time"), apart, "m", "signed distance of two bodies")
        coordinates["pair"] = ("pair", [" and ".join(pair) for pair in model.pair_names])
    if found.observed is not None:
        true = jax.device_get(_followed(robot, motion, found.true_path, study.end_effector))
        variables |= {
            # The true target, whose shapes are given in these axes; an estimated one has those of the marker.
            **_target(true.target),
            "true_grasp_position": of(axes, true.grasp[0], "m", "true grasp frame, inertial frame"),
            "true_grasp_error": of(
                ("time", "error"), true.error, "m, rad, m/s, rad/s", "tool less true grasp frame"
            ),
            "prediction_covariance": of(
                ("error", "other_error"),
                found.prediction.covariance,
                "m, rad, m/s, rad/s, squared",
                "of the predicted grasp frame's errors at the end",
            ),
        }
    return variables, coordinates


def _target(states: TargetState) -> dict:
    return {
        "target_position": of(
            ("time", "axis"), states.position, "m", "target's centre of mass, inertial frame"
        ),
        "target_quaternion": of(("time", "component"), states.quaternion, "1", "target to inertial frame"),
    }


def distances(model: ClearanceModel, robot: Robot, motion: Motion, target: TargetState) -> np.ndarray:
    """Signed distances (p, N + 1), m, the target left out where the model has none."""
    return np.asarray(clearances(model, robot, motion, target if model.has_target else None))


def front_variables(front: CaptureFront) -> dict:
    """Variables of every solution of a front, and what each was chosen as."""
    free = np.stack([plan.free for plan in front.plans])
    chosen = np.array(["" for _ in front.plans], dtype=object)
    for name, number in front.chosen.items():
        chosen[number] = ", ".join(filter(None, [chosen[number], name]))
    return {
        "front_value": of(("solution", "index"), front.values, "1", "indices of each solution"),
        "front_free_numbers": of(("solution", "front_free"), free, "1", "free numbers of each solution"),
        "front_duration": of("solution", [plan.duration for plan in front.plans], "s", "of the motion"),
        "front_chosen": of("solution", [str(name) for name in chosen], "1", "chosen as"),
    }
