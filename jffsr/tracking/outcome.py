"""What became of a tracked path: a code, and a sentence that says what to do."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FIXED, FLOATING
from jffsr.dynamics.kinematics import kinematics, system_com
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.tracking.reach import inside_base, reach
from jffsr.tracking.tracked import Tracked
from jffsr.tracking.verification import TrackingVerification
from jffsr.types import Twist


class TrackingCode(IntEnum):
    """0 is the only success."""

    MET = 0
    LIMITS_EXCEEDED = 1
    LOST_PATH = 2
    UNREACHABLE = 3
    THROUGH_BASE = 4
    NOT_VERIFIED = 5
    NOT_FINITE = 6


@dataclass(frozen=True)
class TrackingTolerances:
    """Largest tool error along the path, m and rad; limits, relative; the re-run's differences, m or rad, and drift."""

    position: float = 0.01
    attitude: float = np.deg2rad(1.0)
    limit: float = 1e-9
    difference: float = 1e-6
    momentum: float = 1e-8


@dataclass(frozen=True)
class TrackingResult:
    """A code and a sentence of advice."""

    code: TrackingCode
    sentence: str

    @property
    def success(self) -> bool:
        """Whether the path was kept, inside every limit, and verified."""
        return self.code is TrackingCode.MET


def check_path(
    robot: Robot,
    time: np.ndarray,
    points: np.ndarray,
    initial_state: State,
    momentum: Twist | None = None,
    end_effector: str | None = None,
    base_mode: str = FLOATING,
) -> TrackingResult | None:
    """What is surely wrong with tool positions (k, 3), m, at times (k,), s, before any tracking; None if nothing.

    The path is out of reach of the system's centre of mass, which moves straight on, or begins inside the base's body;
    on a fixed base no point of it may lie there.
    """
    kin = kinematics(robot, initial_state)
    points, time = np.asarray(points), np.asarray(time)
    centre = np.asarray(system_com(robot, kin) if base_mode != FIXED else initial_state.base_position)
    moved = np.zeros(3)
    if momentum is not None and base_mode != FIXED:
        moved = np.asarray(momentum)[:3] / np.sum(robot.mass)
    distance = np.linalg.norm(points - centre - time[:, None] * moved, axis=-1)
    longest = reach(robot, end_effector, base_mode)
    if np.any(distance > longest):
        k = int(np.argmax(distance > longest))
        of = "the base's centre of mass" if base_mode == FIXED else "the system's centre of mass"
        return TrackingResult(
            TrackingCode.UNREACHABLE,
            f"unreachable: at {time[k]:.4g} s the path is {distance[k]:.4g} m from {of}, and the tool of "
            f"'{robot.name}' never gets farther than {longest:.4g} m from it",
        )
    rotation = np.asarray(quaternion_to_matrix(jnp.asarray(initial_state.base_quaternion)))[None]
    known = len(points) if base_mode == FIXED else 1
    within = inside_base(
        robot, np.asarray(initial_state.base_position), rotation.repeat(known, 0), points[:known]
    )
    return _through_base(time[np.argmax(within)]) if np.any(within) else None


def _through_base(time: float) -> TrackingResult:
    return TrackingResult(
        TrackingCode.THROUGH_BASE,
        f"the path leads through the base's body: the target is inside it at {time:.4g} s",
    )


def outcome(
    robot: Robot,
    tracked: Tracked,
    verification: TrackingVerification,
    tolerances: TrackingTolerances | None = None,
    end_effector: str | None = None,
) -> TrackingResult:
    """The result of a tracked motion on the host; the first of unreachable, not finite, through the base, not verified,
    limits exceeded, lost path that is the case."""
    tolerances, motion = tolerances or TrackingTolerances(), tracked.motion
    time, points = np.asarray(tracked.time), np.asarray(tracked.target_position)
    start = State(motion.base_position[0], motion.base_quaternion[0], motion.joint_position[0])
    wrong = check_path(robot, time, points, start, motion.momentum, end_effector, motion.base_mode)
    if wrong is not None:
        return wrong
    if not np.all(np.isfinite(motion.joint_position)) or not np.all(np.isfinite(tracked.pose_error)):
        return TrackingResult(
            TrackingCode.NOT_FINITE,
            "the motion is not finite: the plain inverse met a singularity; use a damped method",
        )
    rotation = np.asarray(quaternion_to_matrix(motion.base_quaternion))
    within = inside_base(robot, np.asarray(motion.base_position), rotation, points)
    if np.any(within):
        return _through_base(time[np.argmax(within)])
    v = verification
    apart = {
        "the base's position": v.position_difference,
        "the base's attitude": v.attitude_difference,
        "the tool's position": v.tool_position_difference,
        "the tool's attitude": v.tool_attitude_difference,
    }
    what, largest = max(apart.items(), key=lambda item: float(item[1]))
    if not float(largest) <= tolerances.difference or not float(v.momentum_drift) <= tolerances.momentum:
        return TrackingResult(
            TrackingCode.NOT_VERIFIED,
            f"not verified: {what} differs by {float(largest):.3g} from the finer re-run, momentum by "
            f"{float(v.momentum_drift):.3g} relative; raise integration_steps",
        )
    broken = [
        f"{kind} of {name} by {100 * overrun:.3g} %"
        for kind in ("position", "rate", "acceleration")
        for name, overrun in zip(robot.joint_names, np.asarray(getattr(v, f"{kind}_overrun")), strict=True)
        if overrun > tolerances.limit
    ]
    errors = f"{1e3 * float(v.position_error):.4g} mm and {np.rad2deg(float(v.attitude_error)):.4g} deg"
    if broken:
        return TrackingResult(
            TrackingCode.LIMITS_EXCEEDED,
            f"limits exceeded: {', '.join(broken)}; the tool keeps its path to {errors}; let the limits act "
            f"(limits: scale or redistribute), allow more time, or damp more",
        )
    if float(v.position_error) > tolerances.position or float(v.attitude_error) > tolerances.attitude:
        share = float(np.mean(np.asarray(tracked.limited)))
        bound = (
            f"limits acted on {100 * share:.3g} % of the samples, so allow more time"
            if share
            else "no limit acted, so damp less, feed the error back, or allow more time near singularities"
        )
        return TrackingResult(
            TrackingCode.LOST_PATH,
            f"the path was lost: the tool is off by up to {errors}, allowed are {_allowed(tolerances)}; {bound}",
        )
    kept = ", and every limit of position, rate and acceleration as well"
    limits = kept if np.isfinite(tolerances.limit) else "; limits were not looked at"
    return TrackingResult(TrackingCode.MET, f"the path is kept to {errors}{limits}")


def _allowed(tolerances: TrackingTolerances) -> str:
    asked = ((1e3 * tolerances.position, "mm"), (np.rad2deg(tolerances.attitude), "deg"))
    return " and ".join(f"{value:.4g} {unit}" for value, unit in asked if np.isfinite(value))
