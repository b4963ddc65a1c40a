"""A tracked motion against MuJoCo: base and tool at every sample, driven by forces and by conservation of momentum."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jffsr.crosscheck.compare import attitude_difference
from jffsr.crosscheck.drive import check_x64
from jffsr.crosscheck.fine_motion import check_positive
from jffsr.crosscheck.held_rates_run import HeldJoints, HeldMotion, drive_held_rates, integrate_momentum
from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.tracking.mujoco_report import FORCES, MOMENTUM, TrackedCheck, TrackedComparison, TrackedTolerances
from jffsr.tracking.tracked import Tracked


def check_tracked(
    robot: Robot,
    tracked: Tracked,
    end_effector: str | None = None,
    *,
    steps: Sequence[float] = (4e-3, 2e-3),
    tolerances: TrackedTolerances | None = None,
) -> TrackedCheck:
    """Make a tracked motion again in MuJoCo, from its joints alone, and compare base and tool at every sample.

    Driven by the joints' motors, torques while rates are held and impulses where they jump, in equal steps of at most
    each of `steps`, s; and by the conservation of the motion's momentum with MuJoCo's inertia matrix, integrated
    adaptively. Raises InputError for a base that does not float, a step that makes no sense, an unknown end effector, a
    robot that MuJoCo refuses, or JAX in single precision.
    """
    check_x64()
    motion = tracked.motion
    if motion.base_mode != FLOATING:
        raise InputError(
            f"the motion's base_mode is '{motion.base_mode}'; only floating bases are driven in MuJoCo"
        )
    finite = [
        np.all(np.isfinite(x)) for x in (motion.joint_position, motion.joint_velocity, motion.base_position)
    ]
    if not all(finite):
        raise InputError("the motion is not finite; there is nothing to make again in MuJoCo")
    if not len(steps):
        raise InputError("no step length was given; at least one, in seconds, is needed")
    steps = sorted({check_positive("a step", float(step)) for step in steps}, reverse=True)
    held = HeldJoints(
        time=np.asarray(motion.time),
        joint_position=np.asarray(motion.joint_position),
        joint_rate=np.asarray(motion.joint_velocity)[:-1],
        base_position=np.asarray(motion.base_position)[0],
        base_quaternion=np.asarray(motion.base_quaternion)[0],
        momentum=np.asarray(motion.momentum),
    )
    comparisons = [
        _compare(FORCES, step, drive_held_rates(robot, held, step, end_effector), tracked) for step in steps
    ]
    comparisons.append(_compare(MOMENTUM, None, integrate_momentum(robot, held, end_effector), tracked))
    return TrackedCheck(
        robot=robot.name,
        duration=float(motion.time[-1]),
        momentum=tuple(float(x) for x in held.momentum),
        tolerances=tolerances or TrackedTolerances(),
        comparisons=tuple(comparisons),
    )


def _compare(way: str, step: float | None, found: HeldMotion, tracked: Tracked) -> TrackedComparison:
    def apart(ours: Any, theirs: np.ndarray) -> float:
        return float(np.max(np.linalg.norm(np.asarray(ours) - theirs, axis=-1)))

    def turned(ours: Any, theirs: np.ndarray) -> float:
        return float(np.max(attitude_difference(np.asarray(ours), theirs)))

    motion, shares = tracked.motion, found.momentum_share
    error = found.momentum - np.asarray(motion.momentum)
    largest = [float(np.max(np.linalg.norm(part, axis=-1))) for part in (error[:, :3], error[:, 3:])]
    linear, angular = (
        off / float(share) if share != 0 else 0.0 for off, share in zip(largest, shares, strict=True)
    )
    return TrackedComparison(
        way=way,
        step=step,
        attitude=turned(motion.base_quaternion, found.base_quaternion),
        position=apart(motion.base_position, found.base_position),
        tool_attitude=turned(tracked.tool_quaternion, found.tool_quaternion),
        tool_position=apart(tracked.tool_position, found.tool_position),
        tracking=found.tracking_error,
        momentum_linear=linear,
        momentum_angular=angular,
        run_seconds=found.seconds,
    )
