"""A tracked motion as plain arrays, ready to be drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.tracking.singularity.report import SingularityReport
from jffsr.tracking.singularity.task import NEAR_SHARE


@dataclass(frozen=True)
class TrackedRun:
    """What the figures of one tracked motion need, on k samples.

    time (k,), s; target_position and tool_position (k, 3), m, with target_quaternion and tool_quaternion (k, 4), in I;
    error (k, 6): tool less target, m, and the rotation vector from target to tool, rad, in I; singular_values (k, r),
    largest first, and determinant (k,) or None; joint_position and joint_velocity (k, n), rad and rad/s, or m and m/s
    where joint_slides (n,) says so. joint_names (n,); position_lower, position_upper and velocity_limit (n,), infinite
    by default; singular_times, s, instants to mark; threshold of the smallest singular value, below which a
    sample counts as near a singularity, a thirtieth of the median largest by default.
    """

    time: np.ndarray
    target_position: np.ndarray
    target_quaternion: np.ndarray
    tool_position: np.ndarray
    tool_quaternion: np.ndarray
    error: np.ndarray
    singular_values: np.ndarray
    determinant: np.ndarray | None
    joint_position: np.ndarray
    joint_velocity: np.ndarray
    joint_names: Sequence[str] = ()
    joint_slides: np.ndarray | None = None
    position_lower: np.ndarray | None = None
    position_upper: np.ndarray | None = None
    velocity_limit: np.ndarray | None = None
    singular_times: Sequence[float] = ()
    threshold: float | None = None

    @property
    def level(self) -> float:
        """The threshold, given or by default."""
        if self.threshold is not None:
            return float(self.threshold)
        return NEAR_SHARE * float(np.nanmedian(np.asarray(self.singular_values)[:, 0]))

    @property
    def near(self) -> np.ndarray:
        """Which samples (k,) are near a singularity."""
        return np.asarray(self.singular_values)[:, -1] < self.level

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints, given or numbered."""
        count = np.shape(self.joint_position)[1]
        return tuple(self.joint_names) or tuple(f"joint{i + 1}" for i in range(count))

    @property
    def slides(self) -> np.ndarray:
        """Which joints (n,) slide."""
        count = np.shape(self.joint_position)[1]
        return np.zeros(count, bool) if self.joint_slides is None else np.asarray(self.joint_slides, bool)

    def limits(self, variable: str) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits (n,) of "joint_position" or "joint_velocity", infinite where there is none."""
        infinite = np.full(np.shape(self.joint_position)[1], np.inf)
        if variable == "joint_velocity":
            limit = infinite if self.velocity_limit is None else np.asarray(self.velocity_limit)
            return -limit, limit
        lower = -infinite if self.position_lower is None else np.asarray(self.position_lower)
        return lower, infinite if self.position_upper is None else np.asarray(self.position_upper)


def tracked_run(
    tracked: object, robot: Robot | None = None, report: SingularityReport | None = None
) -> TrackedRun:
    """The run of a tracking result, with names and limits from its robot and the instants that a report found."""
    motion = tracked.motion
    extras = {}
    if robot is not None:
        extras = {
            "joint_names": robot.joint_names,
            "joint_slides": ~robot.topology.is_revolute,
            "position_lower": np.asarray(robot.limits.position_lower),
            "position_upper": np.asarray(robot.limits.position_upper),
            "velocity_limit": np.asarray(robot.limits.velocity),
        }
    if report is not None:
        extras["singular_times"] = [point.time for interval in report.intervals for point in interval.points]
        extras["threshold"] = report.threshold
    names = ("target_position", "target_quaternion", "tool_position", "tool_quaternion", "singular_values")
    return TrackedRun(
        time=np.asarray(motion.time),
        **{name: np.asarray(getattr(tracked, name)) for name in names},
        error=np.asarray(tracked.pose_error),
        determinant=None if tracked.determinant is None else np.asarray(tracked.determinant),
        joint_position=np.asarray(motion.joint_position),
        joint_velocity=np.asarray(motion.joint_velocity),
        **extras,
    )


Runs = TrackedRun | Mapping[str, TrackedRun | Mapping]
"""One run, or several by the name of what they compare; arrays by name will do for a run."""


def runs_by_name(runs: Runs) -> dict[str, TrackedRun]:
    """The runs by name, one alone under an empty name; InputError where there is none or a name of arrays is wrong."""
    if isinstance(runs, TrackedRun):
        return {"": runs}
    if not runs:
        raise InputError("no tracked motion was given to draw")
    known = {field.name for field in fields(TrackedRun)}
    found = {}
    for name, run in runs.items():
        if not isinstance(run, TrackedRun):
            unknown = sorted(set(run) - known)
            if unknown:
                raise InputError(
                    f"tracked motion '{name}' has '{unknown[0]}'; allowed are {', '.join(sorted(known))}"
                )
            run = TrackedRun(**run)
        found[str(name)] = run
    return found
