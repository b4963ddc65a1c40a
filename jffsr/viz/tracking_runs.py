"""The runs that a tracking study's result.nc holds, as the figures want them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jffsr.robots.robot import Robot
from jffsr.viz.tracked_run import TrackedRun

if TYPE_CHECKING:
    from xarray import Dataset

_AS_THEY_ARE = ("target_position", "target_quaternion", "tool_position", "tool_quaternion", "joint_position")


def runs_of(dataset: Dataset, robot: Robot, singularities: Mapping[str, Any]) -> dict[str, TrackedRun]:
    """Every tracker's run by its label, alone under an empty one; singularities are those of the study's summary."""
    labels = [str(label) for label in dataset["tracker"].to_numpy()]
    found = {}
    for label in labels:
        one = dataset.sel(tracker=label)
        values = one["singular_values"].to_numpy()
        report = singularities.get(label) or {"intervals": [], "threshold": None}
        found[label if len(labels) > 1 else ""] = TrackedRun(
            time=one["time"].to_numpy(),
            **{name: one[name].to_numpy() for name in _AS_THEY_ARE},
            error=one["pose_error"].to_numpy(),
            joint_velocity=one["joint_velocity"].to_numpy(),
            # Trackers of fewer directions have fewer of them.
            singular_values=values[:, ~np.all(np.isnan(values), axis=0)],
            determinant=one["determinant"].to_numpy() if "determinant" in one else None,
            joint_names=robot.joint_names,
            joint_slides=~robot.topology.is_revolute,
            position_lower=np.asarray(robot.limits.position_lower),
            position_upper=np.asarray(robot.limits.position_upper),
            velocity_limit=np.asarray(robot.limits.velocity),
            singular_times=[p["time"] for interval in report["intervals"] for p in interval["points"]],
            threshold=report["threshold"],
        )
    return found
