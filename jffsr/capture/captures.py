"""Plan captures: candidates, starts, constraints restored, re-run by independent code; one task or a thousand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.approach import HALF_ANGLE
from jffsr.capture.batch import Restored, restore_many
from jffsr.capture.candidates import (
    LOOKS_AWAY,
    CandidateSettings,
    GraspCandidates,
    grasp_candidates,
    least_clearance,
)
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.inverse_kinematics import random_starts
from jffsr.capture.outcome import CaptureCode, CaptureResult, explain_capture
from jffsr.capture.problem import NUM_STEPS, capture_problem
from jffsr.capture.starts import capture_starts
from jffsr.capture.target_clearance import TargetClearance
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.dynamics.base_mode import FLOATING
from jffsr.errors import InputError
from jffsr.objectives.clearance import MISS, Clearance
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import batch_size, spread
from jffsr.planning.plan import check_precision
from jffsr.planning.problem import Problem
from jffsr.planning.result import ResultCode, Tolerances, result_code
from jffsr.planning.verification import Verification, verify
from jffsr.robots.robot import Robot
from jffsr.robots.stacking import first_unlike, stacked
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.types import Array

VERIFIED_AT_ONCE = 16


@dataclass(frozen=True)
class CaptureSettings:
    """How captures are sought; lengths in m, times in s, angles in rad.

    candidates: times and postures to begin from; free_time: whether the grasp time may move within the window; margin
    between all bodies, guard, more than which a plan keeps at its own samples so as to keep the margin between them;
    half_angle of the approach cone, None without one; deceleration, m/s^2, of the tool at the end
    of a start; tolerance of the match, in m, rad, m/s and rad/s; num_steps and control_points of the motion; lanes,
    how many attempts run at once; most_steps of one attempt; step_factor of the re-run.
    """

    candidates: CandidateSettings = field(default_factory=CandidateSettings)
    free_time: bool = True
    margin: float = 0.02
    guard: float = 0.003
    half_angle: float | None = HALF_ANGLE
    deceleration: float = 0.01
    tolerance: float = 1e-6
    num_steps: int = NUM_STEPS
    control_points: int = 8
    lanes: int = 32
    most_steps: int = 60
    step_factor: int = 4
    windows: int = 8


@dataclass(frozen=True)
class CaptureTask:
    """A grasp frame on a moving target, and the clearance model of robot and target (None: bodies may pass through)."""

    path: GraspPath
    clearance: ClearanceModel | None = None


@dataclass(frozen=True)
class Captures:
    """A batch of captures on the host, leading axis (K,) on every array.

    code, int32, of `CaptureCode`; free (K, k), the free numbers; duration (K,), s, of the motion, at whose end is the
    grasp; motion and verification, of the re-run at step_factor times the steps; attempts and jacobians (K,), what was
    spent; problems, with which `motion` and any other quantity can be had again.
    """

    code: np.ndarray
    free: np.ndarray
    duration: np.ndarray
    motion: Motion
    verification: Verification
    attempts: np.ndarray
    jacobians: np.ndarray
    problems: tuple[Problem, ...]

    def result(self, number: int) -> CaptureResult:
        """What became of one of them, in a sentence."""
        verification = jax.tree.map(lambda x: x[number], self.verification)
        return explain_capture(
            self.code[number], self.problems[number], verification, int(self.attempts[number])
        )


def plan_captures(
    robot: Robot,
    tasks: Sequence[CaptureTask],
    initial_state: State,
    settings: CaptureSettings | None = None,
    *,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = FLOATING,
    on_progress: Callable[[int, int], None] | None = None,
) -> Captures:
    """Capture plans for tasks that differ in numbers only, each sought until one keeps its constraints, then re-run.

    Every task begins at initial_state, at rest of the joints, at its path's `begin`. on_progress is told how many tasks
    are solved and how many are open. Raises InputError where tasks are of different structure or 64-bit floats are off;
    what has no plan says so by its code.
    """
    settings, tasks = settings or CaptureSettings(), list(tasks)
    every = _attempts(robot, tasks, initial_state, settings, end_effector, momentum, base_mode)
    problems, task_of, count = every.problems, every.task_of, len(tasks)
    first = np.arange(count) * (len(problems) // count)
    sought = _Sought(first, every.starts[first, 0], count)
    if len(every.promising):
        found = restore_many(
            [problems[k] for k in every.promising],
            every.starts[every.promising],
            task_of=task_of[every.promising],
            lanes=every.lanes(settings.lanes),
            most_steps=settings.most_steps,
            on_progress=on_progress,
        )
        sought.take(found, every.promising, task_of)
    plans = tuple(problems[k] for k in sought.problem)
    motion, verification, verdict = reviewed(plans, sought.free, settings.step_factor)
    code = np.where(verdict == ResultCode.ACCURACY_MET, CaptureCode.CAPTURED, CaptureCode.NOT_VERIFIED)
    code = np.where(sought.kept, code, CaptureCode.NOT_FOUND)
    code = np.where(every.faces, code, CaptureCode.NEVER_FACING)
    code = np.where(every.free_at_start, code, CaptureCode.START_IN_COLLISION).astype(np.int32)
    return Captures(
        code, sought.free, motion.time[:, -1], motion, verification, sought.attempts, sought.jacobians, plans
    )


def different_captures(
    robot: Robot,
    task: CaptureTask,
    initial_state: State,
    settings: CaptureSettings | None = None,
    *,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = FLOATING,
) -> np.ndarray:
    """Free numbers (m, k) that keep the constraints of one capture, from each start that leads to some; not re-run yet.

    Different postures at the grasp, and different ways there: what a front of captures may begin from.
    """
    settings = settings or CaptureSettings()
    every = _attempts(robot, [task], initial_state, settings, end_effector, momentum, base_mode)
    each = every.starts.shape[1]
    if not len(every.promising):
        return np.zeros((0, every.starts.shape[2]))
    found = restore_many(
        [every.problems[k] for k in np.repeat(every.promising, each)],
        every.starts[every.promising].reshape(-1, 1, every.starts.shape[2]),
        lanes=every.lanes(settings.lanes),
        most_steps=settings.most_steps,
    )
    return found.free[found.kept]


@dataclass(frozen=True)
class _Attempts:
    """What can be tried: problems (K c) of each task's times, task_of them, starts (K c, s, k), the promising problems;
    of each task (K,) whether the frame ever faces the tool, and whether the robot starts free of collision."""

    problems: list[Problem]
    task_of: np.ndarray
    starts: np.ndarray
    promising: np.ndarray
    faces: np.ndarray
    free_at_start: np.ndarray

    def lanes(self, most: int) -> int:
        """How many run at once: of how many times are promising, and so the program's shape, it does not depend."""
        return min(most, self.starts.shape[0] * self.starts.shape[1])


def _attempts(
    robot: Robot,
    tasks: list[CaptureTask],
    initial_state: State,
    settings: CaptureSettings,
    end_effector: str | None,
    momentum: Array | None,
    base_mode: str,
) -> _Attempts:
    check_precision("float64")
    if not tasks:
        raise InputError("plan_captures was given no task")
    other = first_unlike([(task.path, task.clearance) for task in tasks])
    if other is not None:
        raise InputError(f"task {other} differs from task 0 in more than numbers; plan it apart")
    chosen = settings.candidates
    drawn = random_starts(robot, jax.random.key(chosen.seed), chosen.starts - 1)
    with all_devices():
        candidates, free_at_start = jax.device_get(
            _candidates(
                stacked([(task.path, task.clearance) for task in tasks]),
                (robot, initial_state, drawn, momentum),
                # Drawn from already: the program is the same for every seed.
                replace(chosen, seed=0),
                end_effector,
                base_mode,
            )
        )
    count, each = candidates.time.shape
    task_of = np.repeat(np.arange(count), each)
    problems = [
        _problem(robot, initial_state, settings, tasks[k], time, end_effector, momentum, base_mode)
        for k, time in zip(task_of, candidates.time.ravel(), strict=True)
    ]
    starts = _starts(problems, [tasks[k].path for k in task_of], candidates, settings, end_effector)
    # A time at which the frame looks away is no candidate.
    facing = candidates.criterion < LOOKS_AWAY
    promising = np.flatnonzero((facing & free_at_start[:, None]).ravel())
    return _Attempts(problems, task_of, starts, promising, np.any(facing, axis=1), free_at_start)


@program(static_argnums=(2, 3, 4))
def _candidates(batch, shared, settings: CandidateSettings, end_effector, base_mode):
    """Candidates of each task, and whether its start is free of collision, (K,)."""
    count = batch_size(batch)
    # What is spread over several devices may not close over arrays.
    shared = jax.tree.map(lambda x: jnp.broadcast_to(x, (count, *jnp.shape(x))), shared)

    def one(item) -> tuple[GraspCandidates, Array]:
        (path, model), (robot, state, starts, momentum) = item
        found = grasp_candidates(
            robot, path, state, starts, model, settings, end_effector, momentum, base_mode
        )
        # When the motion begins is not known where only its end is given; the plan's own clearance sees its start.
        if model is None or path.grasp_time is not None:
            return found, jnp.array(True)
        return found, least_clearance(model, robot, path, jnp.zeros(()), state) > 0

    return spread(one, (batch, shared))


def _problem(
    robot: Robot,
    initial_state: State,
    settings: CaptureSettings,
    task: CaptureTask,
    time: float,
    end_effector: str | None,
    momentum: Array | None,
    base_mode: str,
) -> Problem:
    clearance = None if task.clearance is None else keeping_clear(task.path, task.clearance, settings)
    return capture_problem(
        robot,
        task.path,
        initial_state,
        float(time),
        duration_bounds=settings.candidates.window if settings.free_time else None,
        clearance=clearance,
        half_angle=settings.half_angle,
        control_points=settings.control_points,
        num_steps=settings.num_steps,
        tolerance=settings.tolerance,
        end_effector=end_effector,
        momentum=momentum,
        base_mode=base_mode,
    )


def keeping_clear(path: GraspPath, model: ClearanceModel, settings: CaptureSettings) -> TargetClearance:
    """The constraint that margin and guard be kept at the samples, and the margin on the re-run."""
    keep = Clearance(
        model,
        np.asarray(settings.margin + settings.guard),
        # Without a guard the constraint's own 0.1 mm is left, for rounding.
        tolerance=np.asarray(max(settings.guard / MISS, Clearance.tolerance)),
        windows=settings.windows,
    )
    return TargetClearance(path, keep)


def _starts(
    problems, paths, candidates: GraspCandidates, settings: CaptureSettings, end_effector
) -> np.ndarray:
    """Free numbers (K c, s, k) of the starts of every problem."""

    def flat(x: np.ndarray) -> np.ndarray:
        return np.reshape(x, (len(problems), *x.shape[2:]))

    deceleration = np.full(candidates.error.shape[2], settings.deceleration)
    postures = candidates.joint_position, candidates.base_position, candidates.base_quaternion, candidates.bow
    with all_devices():
        found = capture_starts(
            stacked(problems), stacked(paths), *map(flat, postures), deceleration, end_effector
        )
    return np.asarray(found)


class _Sought:
    """For each task the problem (of one grasp time) and free numbers that were settled on, and what was spent."""

    def __init__(self, problem: np.ndarray, free: np.ndarray, count: int):
        self.problem, self.free = problem, free
        self.kept = np.zeros(count, dtype=bool)
        self.attempts, self.jacobians = np.zeros(count, dtype=int), np.zeros(count, dtype=int)

    def take(self, found: Restored, chosen: np.ndarray, task_of: np.ndarray) -> None:
        """Take over what was found for the chosen problems: of each task what is kept, else what was tried."""
        for place, problem in enumerate(chosen):
            task = task_of[problem]
            self.attempts[task] += found.attempts[place]
            self.jacobians[task] += found.jacobians[place]
            if not self.kept[task] and (found.kept[place] or self.problem[task] == problem):
                self.kept[task], self.free[task], self.problem[task] = (
                    found.kept[place],
                    found.free[place],
                    problem,
                )


def reviewed(problems: Sequence[Problem], free: np.ndarray, step_factor: int):
    """Motions, verifications and codes (K,) of plans, by the independent re-run, some at a time."""
    parts, count = [], len(problems)
    size = min(VERIFIED_AT_ONCE, count)
    for start in range(0, count, size):
        numbers = np.minimum(np.arange(start, start + size), count - 1)
        with all_devices():
            found = jax.device_get(
                _review(stacked([problems[k] for k in numbers]), free[numbers], step_factor)
            )
        parts.append(jax.tree.map(lambda x, left=count - start: x[:left], found))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves), *parts)


@program(static_argnums=2)
def _review(problems: Problem, free: Array, step_factor: int):
    def one(item) -> tuple[Motion, Verification, Array]:
        problem, candidate = item
        motion, verification = verify(problem, candidate, step_factor)
        return motion, verification, result_code(problem, verification, jnp.array(True), Tolerances())

    return spread(one, (problems, free))
