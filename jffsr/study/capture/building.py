"""From a capture study's configuration to the robot, the target's true motion and the planner's settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import jax
import numpy as np
from scipy.spatial.transform import Rotation

from jffsr.capture.candidates import CandidateSettings
from jffsr.capture.capability_map import CapabilityMap
from jffsr.capture.capability_map_file import load_capability_map
from jffsr.capture.captures import CaptureSettings
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.terms import BaseDisturbance, ExecutionTime, LostManipulability
from jffsr.clearance.model import ClearanceModel
from jffsr.errors import InputError
from jffsr.objectives.terms import Term
from jffsr.robots.checks import check_shape
from jffsr.robots.geometry import COLLISION, VISUAL, Geometry, Shape
from jffsr.robots.robot import Robot
from jffsr.robots.shape_schema import ShapeModel
from jffsr.robots.state import State
from jffsr.robots.yaml_schema import rpy_deg_to_matrix
from jffsr.study.building import build_robot
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.capture.schema_planner import CRITERION, FREE
from jffsr.study.capture.schema_target import Attitude
from jffsr.study.lookup import shown
from jffsr.study.start import chosen_end_effector, start_state
from jffsr.target.body import Frame, Target
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import TargetMotion, steps_needed, target_motion
from jffsr.types import Array

_T = TypeVar("_T")
# Printed quaternions are rounded; farther from unit length they are told of, still farther refused.
_ROUNDED, _MISTAKEN = 1e-3, 5e-2
_STEPS = 64
_BEYOND = 1.0
"""s that the target's motion goes on after the window."""


@dataclass(frozen=True)
class CaptureStudy:
    """What is captured by whom: robot and target start together at time zero.

    momentum (6,); target, its shapes in `geometry`, and motion from time zero to beyond the window are the true ones;
    grasps, the frames that may be chosen; capability, for the criterion; notes, what was changed of the input.
    """

    robot: Robot
    initial_state: State
    momentum: Array
    base_mode: str
    end_effector: str
    target: Target
    target_state: TargetState
    geometry: Geometry
    motion: TargetMotion
    capability: CapabilityMap | None
    notes: tuple[str, ...]

    @property
    def mode(self) -> dict:
        """The arguments that planning functions share."""
        return {"momentum": self.momentum, "base_mode": self.base_mode, "end_effector": self.end_effector}


def build_study(config: CaptureConfig) -> CaptureStudy:
    """The study; InputError with file, line and key where robot, target and settings do not fit."""
    robot = build_robot(config)
    start = start_state(config, robot)
    end_effector = chosen_end_effector(config, robot, "grasp a target")
    notes: list[str] = []
    wanted = config.target
    frames = {name: _frame(config, f"target.grasps.{name}", f, notes) for name, f in wanted.grasps.items()}
    marker = _frame(config, "target.marker", wanted.marker, notes)
    target = _told(
        config,
        "target.inertia",
        lambda: Target.create(np.array(wanted.inertia), wanted.mass, marker, frames),
    )
    quaternion = _quaternion(config, "target", wanted, notes)
    rate = (0.0, 0.0, 0.0) if wanted.si("angular_velocity") is None else wanted.si("angular_velocity")
    state = TargetState.create(wanted.position, wanted.velocity, quaternion, rate)
    last = config.grasp_time.window[1] + _BEYOND
    motion = _told(config, "target.angular_velocity", lambda: moving(target, state, last))
    geometry = Geometry(tuple(_shape(config, i, shape) for i, shape in enumerate(wanted.shapes)))
    study = CaptureStudy(
        robot,
        start,
        np.array(config.task.momentum),
        config.task.base_mode,
        end_effector,
        target,
        state,
        geometry,
        motion,
        _capability(config, robot, end_effector),
        tuple(notes),
    )
    build_clearance(config, study, geometry)
    return study


def moving(target: Target, state: TargetState, duration: float) -> TargetMotion:
    """The motion on so many steps that targets which turn a little faster share their compiled programs."""
    needed = steps_needed(target.inertia, state.angular_velocity_T, duration)
    return jax.device_get(target_motion(target, state, duration, -(-needed // _STEPS) * _STEPS))


def build_clearance(config: CaptureConfig, study: CaptureStudy, geometry: Geometry) -> ClearanceModel | None:
    """The clearance model with these shapes of the target; None where bodies may pass through each other."""
    if config.planner.margin is None:
        return None
    return clearance_model(config, study, geometry)


def clearance_model(config: CaptureConfig, study: CaptureStudy, geometry: Geometry) -> ClearanceModel:
    """The clearance model, whether the planner keeps it or not."""
    ignored = [tuple(pair) for pair in config.planner.ignore]
    key = "planner.ignore" if ignored else "planner.margin"
    shapes = geometry if any(COLLISION in shape.roles for shape in geometry.shapes) else None
    return _told(config, key, lambda: ClearanceModel.create(study.robot, shapes, ignore=ignored))


def build_settings(config: CaptureConfig, time: float | None) -> CaptureSettings:
    """The planner's settings for a grasp at this time, s, or for a free one."""
    wanted = config.planner
    window = config.grasp_time.window if time is None else (time, time)
    candidates = CandidateSettings(
        window=window,
        times=wanted.times if time is None else 1,
        apart=wanted.apart,
        starts=wanted.starts,
        postures=wanted.postures,
        largest_bow=wanted.largest_bow,
        seed=config.seed,
    )
    return CaptureSettings(
        candidates=candidates,
        free_time=time is None,
        margin=0.0 if wanted.margin is None else wanted.margin,
        guard=wanted.guard,
        half_angle=wanted.si("cone_half_angle") if wanted.cone else None,
        deceleration=wanted.deceleration,
        tolerance=wanted.tolerance,
        num_steps=wanted.num_steps,
        control_points=wanted.control_points,
        lanes=wanted.lanes,
        most_steps=wanted.most_steps,
        step_factor=config.verification.step_factor,
    )


def fixed_time(config: CaptureConfig, criterion: float | None) -> float | None:
    """The time at which the grasp has to be, s after the robot starts; None for a free one."""
    wanted = config.grasp_time.time
    if wanted == FREE:
        return None
    return criterion if wanted == CRITERION else wanted


def build_indices(config: CaptureConfig, study: CaptureStudy, path: GraspPath) -> tuple[Term, Term]:
    """The base's disturbance and the lost manipulability, whether they are enabled or not."""
    base, lost = config.objective.base_disturbance, config.objective.lost_manipulability
    return (
        BaseDisturbance(np.asarray(base.scale), np.asarray(base.position), np.asarray(base.attitude)),
        LostManipulability(
            path,
            np.asarray(lost.scale),
            np.array(lost.wrench),
            np.asarray(lost.length),
            lost.measure,
            study.end_effector,
        ),
    )


def build_terms(config: CaptureConfig, study: CaptureStudy, path: GraspPath) -> tuple[Term, ...]:
    """The terms that count."""
    wanted = config.objective
    soon = ExecutionTime(np.asarray(wanted.execution_time.scale))
    sections = (wanted.base_disturbance, wanted.lost_manipulability, wanted.execution_time)
    pairs = zip((*build_indices(config, study, path), soon), sections, strict=True)
    return tuple(term for term, section in pairs if section.enabled)


def _quaternion(config: CaptureConfig, key: str, section: Attitude, notes: list[str]) -> np.ndarray:
    """The attitude as a unit quaternion (4,); a printed one that is off unit length by more than rounding is noted."""
    if section.si("rotation_vector") is not None:
        return Rotation.from_rotvec(section.si("rotation_vector")).as_quat(scalar_first=True)
    if section.quaternion is None:
        return np.array([1.0, 0.0, 0.0, 0.0])
    quaternion = np.array(section.quaternion)
    length = float(np.linalg.norm(quaternion))
    where = config.where(f"{key}.quaternion")
    if not abs(length - 1) <= _MISTAKEN:
        found = list(section.quaternion)
        raise InputError(f"{where}: found {found} of norm {length:.4g}, (w, x, y, z) of norm 1 is expected")
    if abs(length - 1) > _ROUNDED:
        notes.append(f"{where}: the quaternion of norm {length:.4g} was normalised")
    return quaternion / length


def _frame(config: CaptureConfig, key: str, section: Attitude, notes: list[str]) -> Frame:
    return np.array(section.position), _quaternion(config, key, section, notes)


def _shape(config: CaptureConfig, number: int, section: ShapeModel) -> Shape:
    roles = {"both": (VISUAL, COLLISION), "visual": (VISUAL,), "collision": (COLLISION,)}[section.role]
    shape = Shape(
        f"{section.type}{number + 1}",
        section.type,
        "target",
        np.array(section.position),
        rpy_deg_to_matrix(section.rpy_deg),
        np.array(section.size),
        roles=roles,
        colour=section.colour,
    )
    check_shape(config.where(f"target.shapes.{number}"), shape)
    return shape


def _capability(config: CaptureConfig, robot: Robot, end_effector: str) -> CapabilityMap | None:
    if config.grasp_time.map is None:
        return None
    found = _told(config, "grasp_time.map", lambda: load_capability_map(shown(Path(config.grasp_time.map))))
    if (found.robot, found.end_effector) != (robot.name, end_effector):
        raise InputError(
            f"{config.where('grasp_time.map')}: the map is of '{found.robot}' with '{found.end_effector}', the robot "
            f"is '{robot.name}' with '{end_effector}'"
        )
    return found


def _told(config: CaptureConfig, key: str, make: Callable[[], _T]) -> _T:
    """What is made, its refusal told with the place of the key."""
    try:
        return make()
    except InputError as error:
        raise InputError(f"{config.where(key)}: {error}") from None
