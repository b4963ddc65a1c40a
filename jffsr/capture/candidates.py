"""When and in which posture a target may be grasped: the few best guesses, for many targets in one program.

The times are those of least criterion (Wang et al. 2021, eq. (15), without the map) that lie apart from each other;
the postures those of inverse kinematics with the floating base. They are where a planner starts, and no promise.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.grasp_time_curves import criterion
from jffsr.capture.inverse_kinematics_floating import floating_inverse_kinematics
from jffsr.clearance.model import ClearanceModel
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Scalar, Vector3

LOOKS_AWAY = 1e6
"""Added to the criterion where the handle looks away from the tool: such times come last."""

_ITERATIONS = {False: 8, True: 20}


@register_dataclass
@dataclass(frozen=True)
class GraspCandidates:
    """What was found, best first.

    time (c,), s, best first, and criterion (c,), m, LOOKS_AWAY or more where the frame looks away, infinite where
    there is no such time; postures at each, best first: joint_position (c, s, n), base_position (c, s, 3), m,
    base_quaternion (c, s, 4), bow (c, s, n), by which the joint path is bent, error (c, s), m and rad added, by which
    that path misses the grasp frame, and clearance (c, s), m, of all bodies there.
    """

    time: Array
    criterion: Array
    joint_position: Array
    base_position: Array
    base_quaternion: Array
    bow: Array
    error: Array
    clearance: Array


@dataclass(frozen=True)
class CandidateSettings:
    """times, how many, at least `apart` s from each other, of `window`, s, at every `step` s; starts of inverse
    kinematics at each time, and how many postures of them are kept; largest_bow, rad or m, of the joints' ways there,
    which at zero are straight; iterations of inverse kinematics, by default 8 or, with bent ways, 20."""

    window: tuple[float, float] = (15.0, 60.0)
    step: float = 1.0
    times: int = 4
    apart: float = 4.0
    starts: int = 6
    postures: int = 3
    iterations: int | None = None
    num_steps: int = 16
    largest_bow: float = 0.0
    seed: int = 1


def grasp_candidates(
    robot: Robot,
    path: GraspPath,
    initial_state: State,
    starts: Array,
    clearance: ClearanceModel | None = None,
    settings: CandidateSettings | None = None,
    end_effector: str | None = None,
    momentum: Array | None = None,
    base_mode: str = "floating",
) -> GraspCandidates:
    """The candidates of one target, for jit and vmap; settings are static.

    The robot starts at the path's `begin`; inverse kinematics from its own joint positions and from `starts` (k, n).
    """
    settings = settings or CandidateSettings()
    first, last = settings.window
    grid = jnp.arange(first, last + settings.step / 2, settings.step)
    tool, _ = end_effector_pose(robot, kinematics(robot, initial_state), end_effector)
    values = jax.vmap(lambda t: grasp_criterion(path, t, tool))(grid)
    times, criteria = [], []
    for _ in range(settings.times):
        best = jnp.argmin(values)
        times.append(grid[best])
        criteria.append(values[best])
        values = jnp.where(jnp.abs(grid - grid[best]) < settings.apart, jnp.inf, values)
    time, least = jnp.stack(times), jnp.stack(criteria)
    position, quaternion, _ = jax.vmap(lambda t: path.frame(t, t))(time)
    start = jnp.concatenate([jnp.asarray(initial_state.joint_position)[None], jnp.asarray(starts)])
    # With the base given way, how long the way takes counts only under momentum; one duration must do for all.
    found = floating_inverse_kinematics(
        robot,
        position,
        quaternion,
        initial_state,
        start,
        momentum=momentum,
        duration=None if momentum is None else jnp.mean(time),
        largest_bow=settings.largest_bow,
        base_mode=base_mode,
        end_effector=end_effector,
        iterations=settings.iterations or _ITERATIONS[settings.largest_bow > 0],
        num_steps=settings.num_steps,
    )
    error = found.position_error + found.attitude_error
    gap = jnp.full(error.shape, jnp.inf)
    if clearance is not None:
        of_time = jax.vmap(
            lambda t, q, r, b: least_clearance(clearance, robot, path, t, State(r, b, q)),
            in_axes=(None, 0, 0, 0),
        )
        gap = jax.vmap(of_time)(time, found.joint_position, found.base_position, found.base_quaternion)
    return _ranked(found, initial_state, error, gap, time, least, settings.postures)


def grasp_criterion(path: GraspPath, time: Scalar, tool: Vector3, value: Scalar | float = 0.0) -> Scalar:
    """(2 |rho| - n_x' rho)/(1 + D), m, of eq. (15), rho (3,) from the tool at its start to the grasp frame at `time`.

    n_x is the grasp frame's first axis, value the capability map's D there; where n_x' rho <= 0 LOOKS_AWAY is added.
    """
    position, quaternion, _ = path.frame(time, time)
    way = position - tool
    approach = quaternion_to_matrix(quaternion)[:, 0]
    found = criterion(way, approach, value)
    return jnp.where(approach @ way > 0, found, found + LOOKS_AWAY)


def least_clearance(
    model: ClearanceModel, robot: Robot, path: GraspPath, time: Scalar, state: State
) -> Scalar:
    """Least signed distance, m, of all pairs with the robot in this state and the target where it is at `time`, s."""
    kin = kinematics(robot, state)
    target = path.target_state(time, time)
    return jnp.min(model(kin.origin, kin.rotation, target.position, quaternion_to_matrix(target.quaternion)))


def _ranked(
    found, initial_state: State, error: Array, gap: Array, time, criterion, count: int
) -> GraspCandidates:
    """The best postures of each time: those that reach it and are clear, near to the start; then the others."""
    away = jnp.linalg.norm(found.joint_position - jnp.asarray(initial_state.joint_position), axis=-1)
    bow = jnp.zeros_like(found.joint_position) if found.bow is None else found.bow
    twice = _repeated(found.joint_position)
    cost = (
        away + 100 * jnp.maximum(error - 1e-3, 0) + 30 * jnp.maximum(0.02 - gap, 0) + jnp.where(twice, 1e3, 0)
    )
    order = jnp.argsort(cost, axis=-1)[:, :count]

    def chosen(leaf: Array) -> Array:
        index = order.reshape(order.shape + (1,) * (leaf.ndim - 2))
        return jnp.take_along_axis(leaf, index, axis=1)

    return GraspCandidates(
        time,
        criterion,
        *(
            chosen(x)
            for x in (found.joint_position, found.base_position, found.base_quaternion, bow, error, gap)
        ),
    )


def _repeated(joints: Array) -> Array:
    """Which of postures (c, s, n) is one that came before, (c, s)."""
    apart = jnp.max(jnp.abs(joints[:, :, None] - joints[:, None]), axis=-1)
    earlier = jnp.tri(joints.shape[1], k=-1, dtype=bool)
    return jnp.any((apart < 0.05) & earlier, axis=-1)
