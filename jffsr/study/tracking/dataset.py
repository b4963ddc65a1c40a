"""Tracked motions as labelled arrays: what result.nc of a tracking study holds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from jffsr.optimizers.driver import Outcome
from jffsr.study.tracking.building import TrackingTask
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.study.tracking.tracked_path import TrackedPath

_SECOND = {"revolute": "rad", "prismatic": "m"}
_MIXED = "m, rad"


def tracking_dataset(
    config: TrackingConfig, task: TrackingTask, paths: Mapping[str, TrackedPath], searched: Outcome | None
):
    """An xarray Dataset of all trackers on the samples of the period that they share, or of one on all of its own."""
    import xarray

    robot = task.robot
    unit = "/".join(sorted({_SECOND[kind] for kind in robot.topology.joint_types}))
    substeps = {path.tracker.substeps for path in paths.values()}
    # Trackers that find their rates at different times have only the samples of the period in common.
    stride = {label: 1 if len(substeps) == 1 else p.tracker.substeps for label, p in paths.items()}

    def of(dims, values, units, meaning):
        return dims, np.asarray(values), {"units": units, "long_name": meaning}

    def each(get, dims, units, meaning):
        values = np.stack([np.asarray(get(path))[:: stride[label]] for label, path in paths.items()])
        return of(("tracker", "time", *dims), values, units, meaning)

    def singular_values(path: TrackedPath) -> np.ndarray:
        found = path.tracked.singular_values
        missing = most - found.shape[1]
        return np.pad(found, ((0, 0), (0, missing)), constant_values=np.nan)

    first = next(iter(paths))
    most = max(path.tracked.singular_values.shape[1] for path in paths.values())
    motion, tracked = (lambda p: p.tracked.motion), (lambda p: p.tracked)
    variables = {
        "joint_position": each(lambda p: motion(p).joint_position, ("joint",), unit, "joint position"),
        "joint_velocity": each(
            lambda p: motion(p).joint_velocity, ("joint",), f"{unit}/s", "joint rate from a sample on"
        ),
        "commanded_rate": each(
            lambda p: tracked(p).commanded_rate, ("joint",), f"{unit}/s", "joint rate before the limits"
        ),
        "base_position": each(
            lambda p: motion(p).base_position, ("axis",), "m", "base centre of mass, inertial frame"
        ),
        "base_quaternion": each(
            lambda p: motion(p).base_quaternion, ("component",), "1", "base to inertial frame"
        ),
        "base_twist": each(
            lambda p: motion(p).base_twist, ("twist",), "m/s, rad/s", "base twist, inertial frame"
        ),
        "target_position": each(lambda p: tracked(p).target_position, ("axis",), "m", "asked of the tool"),
        "target_quaternion": each(
            lambda p: tracked(p).target_quaternion, ("component",), "1", "asked of the tool"
        ),
        "tool_position": each(lambda p: tracked(p).tool_position, ("axis",), "m", "tool, inertial frame"),
        "tool_quaternion": each(
            lambda p: tracked(p).tool_quaternion, ("component",), "1", "tool to inertial frame"
        ),
        "pose_error": each(
            lambda p: tracked(p).pose_error, ("direction",), _MIXED, "tool less target; rotation vector"
        ),
        "singular_values": each(
            singular_values, ("rank",), _MIXED, "of the generalized Jacobian, largest first"
        ),
        "manipulability": each(
            lambda p: tracked(p).manipulability, (), "1", "product of the singular values"
        ),
        "task_share": each(lambda p: tracked(p).share, (), "1", "share of the task that the limits left"),
        "joint_position_lower": of("joint", robot.limits.position_lower, unit, "lower position limit"),
        "joint_position_upper": of("joint", robot.limits.position_upper, unit, "upper position limit"),
        "joint_velocity_limit": of("joint", robot.limits.velocity, f"{unit}/s", "rate limit"),
        "momentum": of("twist", task.momentum, "N s, N m s", "linear, angular about the centre of mass"),
    }
    if paths[first].tracked.determinant is not None:
        variables["determinant"] = each(
            lambda p: tracked(p).determinant, (), "1", "of the generalized Jacobian"
        )
    if searched is not None:
        history = np.array(searched.history, dtype=float).reshape(-1, 5)
        variables |= {
            "history_phase": of("iteration", history[:, 0].astype(int), "1", "phase of the search"),
            "history_evaluations": of("iteration", history[:, 2].astype(int), "1", "paths tracked"),
            "history_gradient_evaluations": of(
                "iteration", history[:, 3].astype(int), "1", "gradients of paths"
            ),
            "history_best_value": of("iteration", history[:, 4], "1", "best index so far"),
        }
    return xarray.Dataset(
        variables,
        coords={
            "tracker": ("tracker", list(paths)),
            "time": ("time", np.asarray(paths[first].tracked.time)[:: stride[first]], {"units": "s"}),
            "joint": ("joint", list(robot.joint_names)),
            "axis": ("axis", ["x", "y", "z"]),
            "component": ("component", ["w", "x", "y", "z"]),
            "twist": ("twist", ["vx", "vy", "vz", "wx", "wy", "wz"]),
            "direction": ("direction", ["x", "y", "z", "about_x", "about_y", "about_z"]),
        },
        attrs={"name": config.name, "robot": robot.name, "end_effector": task.end_effector},
    )
