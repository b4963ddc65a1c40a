"""One motion of many robots in MJX, in one vmapped call, against ours.

There is one MJX model, of the first robot; those of its numbers in which the robots differ travel with a
leading axis. They are what MuJoCo's own compiler makes of each robot, derived numbers included.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from jffsr.crosscheck.batch_report import BatchReport
from jffsr.crosscheck.compare import attitude_difference
from jffsr.crosscheck.drive import check_x64, initial_velocity, make_drive
from jffsr.crosscheck.fine_motion import check_momentum, check_positive, fine_motion
from jffsr.crosscheck.mjx_follow import follow, references
from jffsr.crosscheck.mujoco_model import BASE_COORDINATES, to_mjmodel
from jffsr.crosscheck.quiet import import_mjx
from jffsr.crosscheck.report import Tolerances
from jffsr.errors import InputError
from jffsr.robots.robot import Robot
from jffsr.robots.stacking import stack_robots, unstack_robots
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.rollout import check_duration
from jffsr.trajectories.interface import Trajectory

if TYPE_CHECKING:
    import mujoco


def crosscheck_many(
    robots: Robot | Sequence[Robot],
    trajectory: Trajectory,
    initial_state: State,
    duration: float | None = None,
    momentum: Sequence[float] | None = None,
    *,
    step: float = 1e-3,
    reference: Motion | None = None,
    tolerances: Tolerances | None = None,
) -> BatchReport:
    """Drive many robots along one joint trajectory in MJX, all in one vmapped call, and compare base poses.

    robots is a stacked Robot, each number with a leading axis (K, ...), as `perturbed` gives it, or a sequence
    of robots that differ only in numbers. All start at `initial_state` with the same `momentum` (6,): P, N s,
    then L about the system centre of mass, N m s; None means zero, or that of `reference`. As in `crosscheck`,
    joints follow by motor torques alone, `step`, s, is an upper bound, and the motion compared with is
    `reference`, its leaves (K, ...) too, at its own sample times, or else a fine `reference_rollout` of each
    robot. Raises InputError for robots that differ in more than numbers or that MuJoCo refuses, for a step,
    duration, momentum or reference that makes no sense, and for JAX in single precision.
    """
    check_x64()
    if not isinstance(robots, Robot):
        robots = stack_robots(robots)
    singles = unstack_robots(robots)
    step = check_positive("a step", float(step))
    if reference is not None:
        _check_reference(reference, len(singles))
        duration = float(reference.time[0, -1])
        momentum = reference.momentum[0] if momentum is None else momentum
    duration = check_positive("duration", float(check_duration(trajectory, duration)))
    momentum = check_momentum(momentum)
    if reference is None:
        reference = fine_motion(robots, trajectory, initial_state, duration, momentum, stacked=True)

    sample_time = np.asarray(reference.time[0], dtype=float)
    drive = make_drive(singles[0], trajectory, initial_state, sample_time, step, momentum)
    posture, speed = drive.robot_order(drive.joint_position[0]), drive.robot_order(drive.joint_velocity[0])
    start = State(drive.qpos[:3], drive.qpos[3:BASE_COORDINATES], posture)
    rates = np.array([initial_velocity(robot, start, speed, momentum) for robot in singles])
    poses, tracking, compile_seconds, run_seconds = _run(singles, drive, rates)
    attitude = attitude_difference(np.asarray(reference.base_quaternion), poses[..., 3:BASE_COORDINATES])
    distance = np.linalg.norm(poses[..., :3] - np.asarray(reference.base_position), axis=-1)
    return BatchReport(
        robot=robots.name,
        duration=duration,
        step=drive.step,
        momentum=tuple(float(x) for x in momentum),
        tolerances=tolerances or Tolerances(),
        attitude=np.max(attitude, axis=1),
        position=np.max(distance, axis=1),
        tracking=tracking,
        compile_seconds=compile_seconds,
        run_seconds=run_seconds,
    )


def _run(singles, drive, rates) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Poses (K, S, 7 + n) at the samples, largest tracking errors (K,), and seconds to compile and to run."""
    mjx = import_mjx()
    # Latency decides here as for one robot, and a CPU has less of it than any accelerator.
    with jax.default_device(jax.devices("cpu")[0]):
        models = [to_mjmodel(robot, drive.step) for robot in singles]
        model = mjx.put_model(models[0], impl="jax")
        blank = mjx.make_data(models[0], impl="jax")
        numbers = differing_numbers(model, models)
        rows = references(drive, drive.substeps)

        def run(substeps: int):
            return jax.block_until_ready(
                _follow_many(model, blank, numbers, drive.step, substeps, drive.qpos, rates, rows)
            )

        start = time.perf_counter()
        run(0)
        compiled = time.perf_counter()
        poses, _, error = run(drive.substeps)
        done = time.perf_counter()
    poses = np.asarray(poses)
    last = np.abs(drive.joint_position[-1] - poses[:, -1, BASE_COORDINATES:]).max(axis=1)
    return poses, np.maximum(np.asarray(error), last), compiled - start, done - compiled


@jax.jit
def _follow_many(model, blank, numbers, step, substeps, qpos, rates, rows):
    def one(numbers, rate):
        return follow(model.tree_replace(numbers), blank, step, substeps, qpos, rate, rows)

    return jax.vmap(one)(numbers, rates)


def differing_numbers(mjx_model: Any, models: Sequence[mujoco.MjModel]) -> dict[str, np.ndarray]:
    """Every traced number of an MJX model in which these models differ, (K, ...) each, by field name."""
    found = {}
    for field in fields(mjx_model):
        value = getattr(mjx_model, field.name)
        if not isinstance(value, jax.Array) or not hasattr(models[0], field.name):
            continue
        rows = np.stack([np.asarray(getattr(model, field.name)) for model in models])
        if np.any(rows != rows[:1]):
            found[field.name] = rows.reshape(len(models), *value.shape)
    return found


def _check_reference(reference: Motion, count: int) -> None:
    times = np.asarray(reference.time)
    if times.ndim != 2 or len(times) != count or np.any(times != times[:1]):
        raise InputError(
            f"reference has times of the shape {times.shape}; a motion of each of the {count} robots, all at the "
            f"same sample times, is expected"
        )
