"""The published arm, path and parameters, and what is measured of a tracked motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from jffsr.compiling import jit
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.tracking.between_samples import errors_between
from jffsr.tracking.indices import peak_rate, published_index
from jffsr.tracking.reach import inside_base
from jffsr.tracking.tool_task import ALL, pose_error
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.tracker import Tracker
from jffsr.tracking.tracking import track
from jffsr.trajectories.cartesian.line import Line
from jffsr.trajectories.cartesian.timing import Trapezoid
from jffsr.trajectories.cartesian.tool_trajectory import ToolTrajectory

DURATIONS = (25.0, 15.0)
PERIOD = 0.25
LAMBDA_MAX, EPSILON = 0.0571, 0.0677
RATE_LIMIT_DEG = 6.0
GIVEN_MOMENTUM = np.array([0.5, -0.25, 0.25, 1.0, -1.0, 0.5])
"""N s and N m s: ours, since the paper prints none."""
PUBLISHED = {"lambda_max": LAMBDA_MAX, "epsilon": EPSILON, "limits": "ignore"}
ADAPTIVE = Tracker(**PUBLISHED)
METHODS = {
    "inverse": Tracker(method="inverse", limits="ignore"),
    "damped": Tracker(method="damped", damping=LAMBDA_MAX, limits="ignore"),
    "adaptive": ADAPTIVE,
}
POSTURES_DEG = {
    "published": (175, -60, -60, 0, 210, 5),
    "wrist turned over": (175, -60, -60, -180, 150, 185),
    "shoulder turned over": (-5, -120, 60, 0, 150, -175),
    "other elbow": (175, 35.43, 60, 0, -5.43, 5),
}
"""Start postures with the same pose of the tool; beside each there is one more with the wrist turned over."""


@dataclass(frozen=True)
class Case:
    """The robot, its tool's start pose, and the straight way to the printed goal."""

    robot: Robot
    line: Line

    @classmethod
    def load(cls) -> Case:
        """The published case; the way begins where the tool is."""
        robot = jffsr.load_robot("wu_6dof")
        pose = _tool(robot, np.deg2rad(POSTURES_DEG["published"]))
        goal = np.array([1.50, 0.0, -0.2]), jffsr.euler_to_quaternion(np.array([-3.16, -0.26, -3.14]), "-xyz")
        return cls(robot, Line(*pose, *(jnp.asarray(x) for x in goal)))

    def target(self, duration: float) -> ToolTrajectory:
        """The way in the published trapezoid of rates, ramps of a fifth of the duration, s."""
        return ToolTrajectory(self.line, Trapezoid.over(duration))

    def start(self, posture: str = "published") -> State:
        """The start in one of the postures, in which the tool is where it is in the published one."""
        q = np.deg2rad(POSTURES_DEG[posture])
        for _ in range(6):
            off, slope = _off(self.robot, self.line, q), _off_slope(self.robot, self.line, q)
            q = q - np.linalg.solve(slope, off)
        return _state(q)


def _state(q) -> State:
    return State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), q)


def _tool(robot, q):
    return end_effector_pose(robot, kinematics(robot, _state(q)))


def _off(robot, line, q):
    return pose_error(*_tool(robot, q), line.start_position, line.start_quaternion)


_off_slope = jax.jacfwd(_off, 2)


@partial(jit, static_argnames="samples")
def _track(robot, target, start, tracker, momentum, samples):
    return track(robot, target, start, tracker, momentum=momentum, num_samples=samples)


def follow(case: Case, target: Any, tracker: Tracker, start: State | None = None, momentum=None) -> Tracked:
    """The tracked motion, sampled every quarter of a second."""
    samples = round(float(target.duration) / PERIOD)
    return _track(
        case.robot,
        target,
        case.start() if start is None else start,
        tracker,
        np.zeros(6) if momentum is None else momentum,
        samples,
    )


@partial(jit, static_argnames="freedom")
def _errors(robot, target, tracked, freedom):
    return errors_between(robot, target, tracked, freedom=freedom)


@dataclass(frozen=True)
class Measured:
    """peak, deg/s; index B at the end; largest position, mm, and attitude error, deg, over the whole path, between the
    samples too; those at its end; time (m,), s, and all errors (m, 6), m and rad."""

    peak: float
    index: float
    position: float
    attitude: float
    end_position: float
    end_attitude: float
    time: np.ndarray
    errors: np.ndarray

    def over(self, other: Measured) -> float:
        """The larger of both errors over those of another motion."""
        return max(self.position / other.position, self.attitude / other.attitude)


def measure(case: Case, target: Any, tracked: Tracked, freedom: str = ALL) -> Measured:
    """What is reported of a motion, by the independent finer re-run of its rates."""
    time, errors = (np.asarray(x) for x in _errors(case.robot, target, tracked, freedom))
    position = 1e3 * np.linalg.norm(errors[:, :3], axis=1)
    attitude = np.rad2deg(np.linalg.norm(errors[:, 3:], axis=1))
    return Measured(
        peak=float(np.rad2deg(peak_rate(tracked))),
        index=float(published_index(tracked)),
        position=float(position.max()),
        attitude=float(attitude.max()),
        end_position=float(position[-1]),
        end_attitude=float(attitude[-1]),
        time=time,
        errors=errors,
    )


@jit
def _anchors(robot, motion):
    def one(position, quaternion, q):
        return kinematics(robot, State(position, quaternion, q)).anchor, quaternion_to_matrix(quaternion)

    return jax.vmap(one)(motion.base_position, motion.base_quaternion, motion.joint_position)


def inside_share(case: Case, tracked: Tracked) -> float:
    """The share of the samples at which the arm's way from joint 2 on to the tool, by straight lines from joint to
    joint, leads through the body of the base that the catalogue draws; the paper prints none."""
    anchors, rotation = (np.asarray(x) for x in _anchors(case.robot, tracked.motion))
    corners = np.concatenate([anchors[:, 1:], np.asarray(tracked.tool_position)[:, None]], axis=1)
    part = np.linspace(0, 1, 40)[:, None]
    points = np.concatenate(
        [
            a[:, None] + part * (b - a)[:, None]
            for a, b in zip(*(corners.swapaxes(0, 1)[s] for s in _PAIRS), strict=True)
        ],
        axis=1,
    )
    count = points.shape[1]
    inside = inside_base(
        case.robot,
        np.repeat(np.asarray(tracked.motion.base_position), count, axis=0),
        np.repeat(rotation, count, axis=0),
        points.reshape(-1, 3),
    )
    return float(np.mean(inside.reshape(-1, count).any(axis=1)))


_PAIRS = (slice(None, -1), slice(1, None))
