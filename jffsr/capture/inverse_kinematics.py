"""Joint positions that bring a tool to a pose, within joint limits, for many poses and starts in one call."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.inverse_kinematics_chain import Chain, chain_to_tool, tool_pose, turn_between
from jffsr.capture.inverse_kinematics_step import limited_step
from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.parallel.mapping import spread
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.types import Array

ITERATIONS = 40
TOLERANCE = 1e-6
CHUNK = 512
"""Poses at a time on one core: what they need stays in its second-level cache."""


@register_dataclass
@dataclass(frozen=True)
class JointSolutions:
    """What was found from each of k starts for poses (...).

    joint_position (..., k, n), rad or m, always within the limits; position_error (..., k), m; attitude_error
    (..., k), rad, the angle that is left; success (..., k), whether both are within their tolerances. base_position
    (..., k, 3), m, and base_quaternion (..., k, 4), B to I, where the base floats: its pose when the tool is there; bow
    (..., k, n), rad or m, where the way there was bent.
    """

    joint_position: Array
    position_error: Array
    attitude_error: Array
    success: Array
    base_position: Array | None = None
    base_quaternion: Array | None = None
    bow: Array | None = None

    def best(self, near: Array | None = None) -> JointSolutions:
        """The same without the axis of starts: the success nearest to `near` (..., n), rad or m, in joint space.

        Without `near`, or where no start succeeded, the one with the least errors, m and rad added.
        """
        error = self.position_error + self.attitude_error
        if near is not None:
            away = jnp.sum((self.joint_position - jnp.asarray(near)[..., None, :]) ** 2, axis=-1)
            # Below any failure's: -1/(1 + x) lies in [-1, 0).
            error = jnp.where(self.success, -1 / (1 + away), error)
        place = jnp.argmin(jnp.where(jnp.isnan(error), jnp.inf, error), axis=-1)[..., None]

        def taken(leaf: Array) -> Array:
            index = place.reshape(place.shape + (1,) * (leaf.ndim - place.ndim))
            return jnp.squeeze(jnp.take_along_axis(leaf, index, axis=place.ndim - 1), axis=place.ndim - 1)

        return jax.tree.map(taken, self)


def inverse_kinematics(
    robot: Robot,
    position: Array,
    quaternion: Array,
    starts: Array,
    *,
    end_effector: str | None = None,
    iterations: int = ITERATIONS,
    position_tolerance: float = TOLERANCE,
    attitude_tolerance: float = TOLERANCE,
) -> JointSolutions:
    """Joint positions that bring the tool to poses in the base frame B, from several starts each, with a still base.

    position (..., 3), m, and quaternion (..., 4), E to B, of the tool; starts (k, n) for all poses, or (..., k, n),
    rad or m. Each start is improved by `iterations` (static) steps of damped least squares that keep the joint limits;
    joints that do not move this tool stay as in the start. Works under jit, vmap and forward derivatives. Raises
    InputError for an unknown end effector, shapes that do not fit, and iterations or tolerances that are not positive.
    """
    check_request(robot, position, quaternion, starts, iterations, position_tolerance, attitude_tolerance)
    tolerances = jnp.asarray([position_tolerance, attitude_tolerance])
    position, quaternion, starts = (jnp.asarray(x) for x in (position, quaternion, starts))
    return _solve(robot, position, quaternion, starts, tolerances, end_effector, int(iterations))


@program(static_argnums=(5, 6))
def _solve(robot, position, quaternion, starts, tolerances, end_effector, iterations) -> JointSolutions:
    chain = chain_to_tool(robot, end_effector)
    limits = robot.limits

    def one(item) -> JointSolutions:
        wanted, attitude, start = item
        found, errors = descend(chain, tuple(wanted), tuple(attitude), start, iterations)
        return JointSolutions(found, *errors, success(found, errors, limits, tolerances))

    return over_starts(one, position, quaternion, starts)


def descend(chain: Chain, position, quaternion, start: Array, iterations: int):
    """Joint positions (n,) from one start, and what is left in position, m, and attitude, rad."""
    length = chain.length

    def step(_, state):
        q = state[0]
        pose = tool_pose(chain, q)
        away = tuple(a - b for a, b in zip(position, pose.position, strict=True))
        left = (*away, *turn_between(quaternion, pose.quaternion))
        following = limited_step(pose.rows, left, q, chain.lower, chain.upper, length)
        return jax.lax.optimization_barrier((following, q, left))

    first = jnp.clip(start[chain.index], chain.lower, chain.upper)
    # One round more than steps: the kinematics is compiled once, for the steps and for what is left after the last.
    blank = (first[0] * 0,) * 6
    _, q, left = jax.lax.fori_loop(0, iterations + 1, step, (first, first, blank))
    return start.at[chain.index].set(q), (_length(left[:3]), _length(left[3:]))


def _length(v) -> Array:
    squared = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    positive = squared > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared, 1.0)), 0.0)


def success(found: Array, errors, limits, tolerances: Array) -> Array:
    """Whether joint positions (n,) bring the tool within the tolerances (2,) and keep the limits; shape ()."""
    inside = jnp.all((found >= limits.position_lower) & (found <= limits.position_upper))
    return inside & (errors[0] <= tolerances[0]) & (errors[1] <= tolerances[1])


def over_starts(one, position: Array, quaternion: Array, starts: Array, chunk: int = CHUNK) -> JointSolutions:
    """A function of one pose and one start, over all (..., k) of them, `chunk` at a time on each device."""
    count = starts.shape[-2]
    batch = jnp.broadcast_shapes(position.shape[:-1], quaternion.shape[:-1], starts.shape[:-2])

    def flat(x: Array) -> Array:
        return jnp.broadcast_to(x[..., None, :], (*batch, count, x.shape[-1])).reshape(-1, x.shape[-1])

    each = jnp.broadcast_to(starts, (*batch, *starts.shape[-2:])).reshape(-1, starts.shape[-1])
    found = spread(one, (flat(position), flat(quaternion), each), chunk=chunk)
    return jax.tree.map(lambda x: x.reshape((*batch, count, *x.shape[1:])), found)


def check_request(robot, position, quaternion, starts, iterations, *tolerances) -> None:
    """Refuse, by InputError, what cannot be asked of inverse kinematics."""
    shapes = {"position": (position, 3), "quaternion": (quaternion, 4)}
    for name, (value, size) in shapes.items():
        if np.shape(value)[-1:] != (size,):
            raise InputError(
                f"inverse kinematics: {name} has the shape {np.shape(value)}, (..., {size}) is expected"
            )
    if np.ndim(starts) < 2 or np.shape(starts)[-1] != robot.num_joints or np.shape(starts)[-2] < 1:
        raise InputError(
            f"inverse kinematics: starts have the shape {np.shape(starts)}, (k, {robot.num_joints}) with at least one "
            f"start is expected for robot '{robot.name}'"
        )
    try:
        np.broadcast_shapes(np.shape(position)[:-1], np.shape(quaternion)[:-1], np.shape(starts)[:-2])
    except ValueError:
        raise InputError(
            f"inverse kinematics: leading axes of position {np.shape(position)}, quaternion {np.shape(quaternion)} and "
            f"starts {np.shape(starts)} do not fit together"
        ) from None
    if iterations < 1 or not all(tolerance > 0 for tolerance in tolerances):
        raise InputError("inverse kinematics: iterations and tolerances have to be positive")


def random_starts(robot: Robot, key: Array, count: int) -> Array:
    """Joint positions (count, n), rad or m, drawn uniformly within the limits, +-pi and +-1 m where there is none."""
    turning = robot.topology.is_revolute
    lower, upper = np.asarray(robot.limits.position_lower), np.asarray(robot.limits.position_upper)
    lower = np.where(np.isfinite(lower), lower, np.where(turning, -np.pi, -1.0))
    upper = np.where(np.isfinite(upper), upper, np.where(turning, np.pi, 1.0))
    return jax.random.uniform(key, (count, robot.num_joints), minval=lower, maxval=upper)
