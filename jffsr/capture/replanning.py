"""A capture under way, planned anew as the target becomes better known.

From where the joints are, with the rate and acceleration that they have, the rest of the motion is restored to what is
now known of the target, from the rest of the plan that is under way: where that knowledge has changed by millimetres, a
few steps do. The grasp's time stays as it was. Where no plan is found the old one goes on.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.batch import restore_many
from jffsr.capture.captures import CaptureSettings, keeping_clear
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import grasp_error
from jffsr.capture.problem import capture_problem
from jffsr.clearance.model import ClearanceModel
from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.planning.problem import Problem
from jffsr.robots.state import State
from jffsr.rollouts.rollout import rollout
from jffsr.trajectories.bspline import ClampedBSpline, basis
from jffsr.types import Array, Scalar, Vector

LATEST = 2.0
"""s before the grasp, after which nothing is planned anew: what is left could not be moved much within the limits."""

_PER_POINT = 8  # samples of the old way for each control point of the new one


@dataclass(frozen=True)
class Knowledge:
    """What is known of the target at `time`, s after the robot starts: where its grasp frame goes, by the robot's time,
    and the clearance model of its bodies, in the axes of that path's target."""

    time: float
    path: GraspPath
    clearance: ClearanceModel | None = None


@dataclass(frozen=True)
class Leg:
    """A plan for the rest of a capture: it begins `begin` s after the robot starts; problem, and its free numbers."""

    begin: float
    problem: Problem
    free: np.ndarray

    @property
    def law(self) -> ClampedBSpline:
        """The joint motion, by the time since `begin`."""
        return self.problem.trajectory.with_free(self.free)

    @property
    def end(self) -> float:
        """When the grasp is, s after the robot starts."""
        return self.begin + float(self.law.duration)


@dataclass(frozen=True)
class ReplannedCapture:
    """The plans that were followed one after another, and the times, s, at which no new one was found.

    Called with a time after the robot's start it gives joint position, rate and acceleration, (n,) each.
    """

    legs: tuple[Leg, ...]
    refused: tuple[float, ...] = ()

    @property
    def duration(self) -> float:
        """When the grasp is, s after the robot starts."""
        return self.legs[-1].end

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """The leg that has begun last."""
        found = self.legs[0].law(time)
        for leg in self.legs[1:]:
            begun = time >= leg.begin
            later = leg.law(jnp.where(begun, time - leg.begin, 0.0))
            found = tuple(jnp.where(begun, new, old) for new, old in zip(later, found, strict=True))
        return found

    def error(self, path: GraspPath) -> np.ndarray:
        """Errors (12,) of the tool at the end, m, rad, m/s and rad/s, against a grasp frame by the robot's time: the
        true one, say."""
        leg = self.legs[-1]
        return np.asarray(_error(leg.problem, leg.free, _from(path, leg.begin)))


def replanned(
    problem: Problem,
    free: Array,
    knowledge: Iterable[Knowledge],
    settings: CaptureSettings | None = None,
    *,
    latest: float = LATEST,
) -> ReplannedCapture:
    """A capture planned as (problem, free), from rest, and planned anew each time that more is known.

    knowledge in the order of time; what comes less than `latest` s before the grasp is of no use any more. The robot is
    taken to follow its plans; `next_leg` takes a measured state. settings as for `plan_captures`, those of the first
    plan. Raises InputError for knowledge out of order.
    """
    leg = Leg(0.0, problem, np.asarray(free))
    legs, refused, last = [leg], [], 0.0
    for known in knowledge:
        if not known.time > last:
            raise InputError(f"replanning: knowledge of {known.time:g} s comes after that of {last:g} s")
        last = known.time
        if known.time > leg.end - latest:
            break
        found = next_leg(leg, known, settings)
        if found is None:
            refused.append(known.time)
        else:
            leg = found
            legs.append(leg)
    return ReplannedCapture(tuple(legs), tuple(refused))


def next_leg(
    leg: Leg, known: Knowledge, settings: CaptureSettings | None = None, state: State | None = None
) -> Leg | None:
    """The plan from `known.time` on, or None where none is found from the rest of this leg.

    state, base pose and joint positions and velocities as measured then; those of the leg where it is None.
    """
    settings, since = settings or CaptureSettings(), known.time - leg.begin
    law = leg.law
    _, rate, acceleration = (np.asarray(x) for x in law(since))
    if state is None:
        state = replace(jax.device_get(_state_after(leg.problem, leg.free, since)), joint_velocity=rate)
    path, match = _from(known.path, known.time), leg.problem.constraints[0]
    problem = capture_problem(
        leg.problem.robot,
        path,
        state,
        leg.end - known.time,
        joint_acceleration=acceleration,
        clearance=None if known.clearance is None else keeping_clear(path, known.clearance, settings),
        half_angle=settings.half_angle,
        control_points=settings.control_points,
        num_steps=settings.num_steps,
        tolerance=settings.tolerance,
        end_effector=match.end_effector,
        momentum=leg.problem.momentum,
        base_mode=leg.problem.base_mode,
    )
    problem = replace(problem, objective=leg.problem.objective)
    start = rest_of(law, since, problem.trajectory)
    low, high = problem.bounds()
    start = np.clip(start.ravel(), low, high)
    found = restore_many([problem], start[None, None], lanes=1, most_steps=settings.most_steps)
    return Leg(known.time, problem, found.free[0]) if found.kept[0] else None


def rest_of(law: ClampedBSpline, since: float, onwards: ClampedBSpline) -> Array:
    """Inner control points (f, n) with which `onwards`, which has a free end, comes nearest to what is left of `law`
    after `since` s, by least squares."""
    fixed = onwards.control_points.shape[0] - onwards.inner.shape[0]
    share = np.linspace(0.0, 1.0, _PER_POINT * onwards.inner.shape[0] + 1)
    wanted = np.asarray(law.on_grid(since + share * float(onwards.duration))[0])
    functions = basis(onwards.knots, onwards.degree, share)[-1]
    left = wanted.T - functions[:fixed].T @ np.asarray(onwards.control_points)[:fixed]
    return np.linalg.lstsq(functions[fixed:].T, left, rcond=None)[0]


def _from(path: GraspPath, time: float) -> GraspPath:
    """The path by a clock that starts `time` s later."""
    return replace(path, begin=np.asarray(path.begin + time, float))


@program()
def _state_after(problem: Problem, free: Array, since: Scalar) -> State:
    law = problem.trajectory.with_free(free)
    motion = rollout(
        problem.robot,
        law,
        problem.initial_state,
        since,
        problem.num_steps,
        problem.momentum,
        problem.base_mode,
    )
    return State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])


@program()
def _error(problem: Problem, free: Array, path: GraspPath) -> Vector:
    return grasp_error(problem.robot, problem.motion(free), path, problem.constraints[0].end_effector)
