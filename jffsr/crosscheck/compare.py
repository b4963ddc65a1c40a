"""A motion against MuJoCo and MJX: differences in base pose and in momentum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jffsr.crosscheck.drive import EngineMotion, check_x64, make_drive
from jffsr.crosscheck.fine_motion import check_momentum, check_positive, fine_motion
from jffsr.crosscheck.mjx_run import run_mjx
from jffsr.crosscheck.mujoco_run import run_mujoco
from jffsr.crosscheck.report import ENGINE_TITLES, Comparison, CrosscheckReport, Tolerances
from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.rollout import check_duration
from jffsr.trajectories.interface import Trajectory


def crosscheck(
    robot: Robot,
    trajectory: Trajectory,
    initial_state: State,
    duration: float | None = None,
    momentum: Sequence[float] | None = None,
    *,
    steps: Sequence[float] = (2e-3, 1e-3),
    engines: Sequence[str] = ("mujoco", "mjx"),
    reference: Motion | None = None,
    tolerances: Tolerances | None = None,
) -> CrosscheckReport:
    """Drive the robot's joints along the trajectory in other engines and compare the base's motion.

    In each engine gravity is zero, the base is free and never written after t = 0, and the joints follow by
    motor torques alone. `steps`, s, are upper bounds: each engine takes equal steps between the samples.
    `momentum` (6,) is P, N s, then L about the system centre of mass, N m s; None means zero, or that of
    `reference`. The motion compared with is `reference`, at its own sample times, where it is given; else
    100 intervals of a fine `reference_rollout`. Raises InputError for an unknown engine, a step, duration
    or momentum that makes no sense, a robot that MuJoCo refuses, or JAX in single precision.
    """
    check_x64()
    tolerances = tolerances or Tolerances()
    engines = _check_engines(engines)
    steps = _check_steps(steps)
    if reference is not None:
        if reference.base_mode != FLOATING:
            raise InputError(
                f"the motion's base_mode is '{reference.base_mode}'; only floating bases are driven in MuJoCo and MJX"
            )
        duration = float(reference.time[-1])
        momentum = reference.momentum if momentum is None else momentum
    duration = check_positive("duration", float(check_duration(trajectory, duration)))
    momentum = check_momentum(momentum)
    if reference is None:
        reference = fine_motion(robot, trajectory, initial_state, duration, momentum)

    sample_time = np.asarray(reference.time, dtype=float)
    drives = [make_drive(robot, trajectory, initial_state, sample_time, step, momentum) for step in steps]
    comparisons = []
    for engine in engines:
        motions = (
            [run_mujoco(robot, drive) for drive in drives] if engine == "mujoco" else run_mjx(robot, drives)
        )
        comparisons += [
            _compare(engine, drive.step, motion, reference, momentum)
            for drive, motion in zip(drives, motions, strict=True)
        ]
    return CrosscheckReport(
        robot=robot.name,
        duration=duration,
        momentum=tuple(float(x) for x in momentum),
        tolerances=tolerances,
        comparisons=tuple(comparisons),
    )


def attitude_difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (...,), rad, of the rotation between unit quaternions (..., 4); exact for small angles too."""
    w = np.abs(np.sum(a * b, axis=-1))
    cross = a[..., :1] * b[..., 1:] - b[..., :1] * a[..., 1:] - np.cross(a[..., 1:], b[..., 1:])
    return 2 * np.arctan2(np.linalg.norm(cross, axis=-1), w)


def _compare(
    engine: str, step: float, motion: EngineMotion, reference: Motion, momentum: np.ndarray
) -> Comparison:
    def largest(rows: np.ndarray) -> float:
        return float(np.max(np.linalg.norm(rows, axis=-1)))

    error = motion.momentum - momentum
    linear, angular = largest(error[:, :3]), largest(error[:, 3:])
    shares = motion.momentum_share
    return Comparison(
        engine=engine,
        step=step,
        attitude=float(
            np.max(attitude_difference(np.asarray(reference.base_quaternion), motion.base_quaternion))
        ),
        position=largest(motion.base_position - np.asarray(reference.base_position)),
        tracking=motion.tracking_error,
        momentum_linear=linear,
        momentum_angular=angular,
        momentum_linear_relative=linear / float(shares[0]) if shares[0] != 0 else 0.0,
        momentum_angular_relative=angular / float(shares[1]) if shares[1] != 0 else 0.0,
        compile_seconds=motion.compile_seconds,
        run_seconds=motion.run_seconds,
    )


def _check_engines(engines: Sequence[str]) -> tuple[str, ...]:
    names = (engines,) if isinstance(engines, str) else tuple(dict.fromkeys(engines))
    for name in names:
        if name not in ENGINE_TITLES:
            raise InputError(f"engine '{name}' is not known; allowed are {', '.join(ENGINE_TITLES)}")
    if not names:
        raise InputError(f"no engine was named; allowed are {', '.join(ENGINE_TITLES)}")
    return names


def _check_steps(steps: Sequence[float]) -> list[float]:
    if not len(steps):
        raise InputError("no step length was given; at least one, in seconds, is needed")
    return sorted({check_positive("a step", float(step)) for step in steps}, reverse=True)
