"""From a tracking study's configuration to the robot, its tool's path and the trackers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.study.building import build_robot
from jffsr.study.calls import called_function
from jffsr.study.start import chosen_end_effector, start_state
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.study.tracking.schema_path import ARC, CALL, FASTEST, LINE, QUINTIC, SPLINE, WAYPOINTS
from jffsr.study.tracking.schema_tracker import Secondary
from jffsr.study.tracking.schema_tracker import Tracker as TrackerSection
from jffsr.tracking.indices import PathError, PublishedIndex
from jffsr.tracking.redundancy import (
    BaseAttitudeHeld,
    JointLimitAvoidance,
    ManipulabilityGradient,
    SecondaryTask,
)
from jffsr.tracking.retiming import fastest_tracking, stretched
from jffsr.tracking.tool_task import rotation_between
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tuning import TuningProblem, tuning
from jffsr.trajectories.cartesian.arc import Arc
from jffsr.trajectories.cartesian.interface import ToolPath
from jffsr.trajectories.cartesian.line import Line
from jffsr.trajectories.cartesian.pose_spline import PoseSpline
from jffsr.trajectories.cartesian.poses import checked_pose
from jffsr.trajectories.cartesian.tabulated import Tabulated
from jffsr.trajectories.cartesian.timing import Quintic, Trapezoid
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory
from jffsr.trajectories.cartesian.waypoints import Waypoints
from jffsr.types import Array


@dataclass(frozen=True)
class TrackingTask:
    """What is tracked: the robot with its limits, where it starts, with what momentum (6,), and the tool's target."""

    robot: Robot
    target: ToolTrajectory
    initial_state: State
    momentum: Array
    end_effector: str | None
    base_mode: str


def build_task(config: TrackingConfig) -> TrackingTask:
    """The task; InputError with file, line and key where the robot, its start and the path do not fit."""
    robot = build_robot(config)
    start = start_state(config, robot)
    end_effector = chosen_end_effector(config, robot, "follow a path")
    path = build_path(config, _tool_pose(robot, start, end_effector))
    momentum, base_mode = np.array(config.task.momentum), config.task.base_mode
    if config.timing.kind == FASTEST:
        law = _fastest(config, robot, path, start, end_effector)
    elif config.timing.kind == QUINTIC:
        law = Quintic.over(config.timing.duration)
    else:
        law = Trapezoid.over(config.timing.duration, config.timing.ramp_fraction)
    return TrackingTask(robot, ToolTrajectory(path, law), start, momentum, end_effector, base_mode)


def _fastest(
    config: TrackingConfig, robot: Robot, path: ToolPath, start: State, end_effector: str
) -> Tabulated:
    if any(config.task.momentum):
        raise InputError(
            f"{config.where('timing.kind')}: found 'fastest', which needs zero momentum; 'trapezoid' or 'quintic' is "
            "expected"
        )
    tracker = build_tracker(config.tracker)
    try:
        timing = fastest_tracking(
            robot,
            path,
            start,
            tracker,
            config.timing.margin,
            end_effector=end_effector,
            base_mode=config.task.base_mode,
        )
    except InputError as error:
        raise InputError(f"{config.where('timing.kind')}: {error}") from None
    return stretched(timing, tracker.period)


def _tool_pose(robot: Robot, state: State, end_effector: str) -> tuple[np.ndarray, np.ndarray]:
    position, quaternion = end_effector_pose(robot, kinematics(robot, state), end_effector)
    return np.asarray(position), np.asarray(quaternion)


def build_path(config: TrackingConfig, tool: tuple[np.ndarray, np.ndarray]) -> ToolPath:
    """The path, from where the tool is if it is to start there; InputError where that is too far from its start."""
    path = config.path
    if path.kind == CALL:
        function = called_function(path.call, config.where("path.call"), "s in [0, 1]")
        try:
            begun = ToolTrajectory(function, Quintic.over(1.0))
            first = checked_pose([np.asarray(x) for x in begun.path(np.zeros(()))], None, "start")
        except Exception as error:
            raise InputError(f"{config.where('path.call')}: '{path.call}' gives no path: {error}") from None
        _check_start(config, first, tool, "path.call")
        return begun.path
    poses = []
    for i, given in enumerate(path.poses):
        try:
            poses.append(checked_pose((given.position, given.attitude), path.order, f"pose {i}"))
        except InputError as error:
            raise InputError(f"{config.where(f'path.poses.{i}')}: {error}") from None
    _check_start(config, poses[0], tool, "path.poses.0")
    if path.start == "actual":
        poses[0] = tool
    try:
        return _path(config, poses)
    except InputError as error:
        raise InputError(f"{config.where('path.poses')}: {error}") from None


def _path(config: TrackingConfig, poses: list) -> ToolPath:
    path = config.path
    if path.kind == LINE:
        return Line.between(*poses)
    if path.kind == WAYPOINTS:
        radius = np.inf if path.blend_radius is None else path.blend_radius
        return Waypoints.through(
            poses,
            blend_share=path.blend_share,
            blend_radius=radius,
            metres_per_radian=path.metres_per_radian,
        )
    if path.kind == ARC:
        return Arc.through(poses[0], path.via, poses[1], path.attitude)
    if path.kind == SPLINE:
        return PoseSpline.through(poses, path.degree, metres_per_radian=path.metres_per_radian)
    raise AssertionError(path.kind)


def _check_start(config: TrackingConfig, first, tool, key: str) -> None:
    allowed = config.path.start_tolerance
    far = float(np.linalg.norm(first[0] - tool[0]))
    turned = float(np.linalg.norm(rotation_between(first[1], tool[1])))
    if far > allowed.position or turned > allowed.si("attitude"):
        raise InputError(
            f"{config.where(key)}: the path starts {1e3 * far:.3g} mm and {np.rad2deg(turned):.3g} deg from the tool, "
            f"which is at {np.round(tool[0], 4).tolist()} m; path.start_tolerance allows "
            f"{1e3 * allowed.position:g} mm and {np.rad2deg(allowed.si('attitude')):g} deg"
        )


def build_tracker(section: TrackerSection) -> Tracker:
    """The tracker of a section."""
    values = {name: getattr(section, name) for name in type(section).model_fields if name != "secondary"}
    return Tracker(**values, secondary=tuple(_secondary(task) for task in section.secondary))


def _secondary(task: Secondary) -> SecondaryTask:
    if task.task == "base_attitude":
        return BaseAttitudeHeld(task.gain, decoupled=task.decoupled)
    return {"joint_limits": JointLimitAvoidance, "manipulability": ManipulabilityGradient}[task.task](
        task.gain
    )


def build_tuning(config: TrackingConfig, task: TrackingTask) -> TuningProblem:
    """The search for numbers of the study's own tracker; InputError where they do not fit."""
    wanted = config.tuning
    limit = wanted.si("rate_limit")
    if limit is None:
        limit = np.asarray(task.robot.limits.velocity)
    index = (
        PublishedIndex(limit, wanted.weight)
        if wanted.index == "published"
        else PathError(limit, wanted.weight, wanted.radius)
    )
    try:
        return tuning(
            task.robot,
            task.target,
            task.initial_state,
            build_tracker(config.tracker),
            index,
            wanted.parameters,
            task.momentum,
            end_effector=task.end_effector,
            base_mode=task.base_mode,
        )
    except InputError as error:
        raise InputError(f"{config.where('tuning.parameters')}: {error}") from None
