"""Zero-reaction manoeuvres: from one posture to another with the base's attitude kept all the way, if there is a way.

Without momentum the rates qd = N(q) zeta(t) turn the base nowhere, N being the projector on the coupling's null space
(Nenchev, Umetani and Yoshida 1992; Dimitrov and Yoshida 2004). zeta is a smooth window, zero with its slope at both
ends, times polynomials whose coefficients bring the integral from the start to the goal: least-norm steps of Levenberg
and Marquardt on the end's error, from several starts at once. What stands still does so exactly, whatever the
coefficients are; only the arrival is searched for.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.reactionless.manoeuvre_path import SampledPath
from jffsr.reactionless.manoeuvre_space import Reach, coupling_rows, null_projector, reach_of
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.rollout import check_steps, rollout
from jffsr.spatial.rotation import quaternion_to_rotation_vector
from jffsr.types import Array, Scalar, Vector

# The path's steps are that many times as fine as the search's, and this many iterations bring it to its end again.
_FINER, _POLISHING = 4, 6


class ManoeuvreCode(IntEnum):
    """0 is the only success."""

    FOUND = 0
    NO_NULL_SPACE = 1
    ON_A_SURFACE = 2
    NOT_FOUND = 3
    LIMITS_EXCEEDED = 4
    NOT_VERIFIED = 5


@dataclass(frozen=True)
class ManoeuvreSettings:
    """degree: of the polynomials in zeta, per joint; starts: searched at once; scatter, rad or m: deviation of their
    coefficients; iterations: of each; steps: of the search's integration, and a quarter of the path's; tolerance,
    rad or m: of the goal; turn, rad: largest rotation of the base in the rollout that verifies."""

    degree: int = 4
    starts: int = 6
    scatter: float = 1.0
    iterations: int = 80
    steps: int = 40
    tolerance: float = 1e-8
    turn: float = 1e-7


@dataclass(frozen=True)
class Manoeuvre:
    """What was found: a code and a sentence; the path, None where none leads to the goal; end_error, rad or m, the best
    arrival; turn, rad, the base's largest rotation in a rollout that knows nothing of the plan, NaN without a path;
    reach: what the null space and its brackets span."""

    code: ManoeuvreCode
    sentence: str
    path: SampledPath | None
    end_error: float
    turn: float
    reach: Reach

    @property
    def success(self) -> bool:
        """Whether a manoeuvre was found, inside the limits, and verified."""
        return self.code is ManoeuvreCode.FOUND


def zero_reaction_manoeuvre(
    robot: Robot,
    start: Vector,
    goal: Vector,
    duration: float,
    settings: ManoeuvreSettings | None = None,
    key: Array | None = None,
) -> Manoeuvre:
    """A manoeuvre between postures (n,), rad or m, at rest, in `duration`, s, under no momentum.

    What is checked where none is found: the null space's dimension and the rank of its brackets of two and three in
    postures between and around both. Raises InputError for postures, durations and steps that are none.
    """
    settings = settings or ManoeuvreSettings()
    start, goal = (_posture(robot, what, q) for what, q in (("start", start), ("goal", goal)))
    if not np.isfinite(duration) or duration <= 0:
        raise InputError(f"duration is {duration!r}; a positive number of seconds is expected")
    steps = check_steps(settings.steps)
    about = np.random.default_rng(0).normal(scale=0.2, size=(4, robot.num_joints)) + 0.5 * (start + goal)
    postures = np.concatenate([[start, goal], about])
    rows = coupling_rows(robot, postures)
    reach = reach_of(robot, rows, postures)
    apart = float(np.max(np.abs(goal - start)))
    if reach.null_dimension == 0 and apart > settings.tolerance:
        text = (
            f"none can exist: {robot.num_joints} joints have no rates that leave the base alone, for the coupling has
            rank " f"{len(rows)}; use an arm with more joints, or hold fewer axes"
        )
        return Manoeuvre(ManoeuvreCode.NO_NULL_SPACE, text, None, apart, np.nan, reach)
    key = jax.random.PRNGKey(0) if key is None else key
    shape = (settings.starts, robot.num_joints, settings.degree + 1)
    # The first goes straight, as far as the null space lets it.
    first = settings.scatter * jax.random.normal(key, shape).at[0].set(0.0)
    first = first.at[:, :, 0].add(goal - start)
    given = robot, jnp.asarray(rows), jnp.asarray(start), jnp.asarray(goal)
    coefficients, errors, lengths = _search(*given, first, settings.iterations, steps)
    arrived = errors <= settings.tolerance
    if not np.any(arrived):
        return _none(reach, robot.num_joints, float(np.min(errors)), settings)
    best = int(np.argmin(np.where(arrived, lengths, np.inf)))
    # Finer steps: between its samples a path is only as still as they are consistent with each other.
    coefficients, errors, _ = _search(*given, coefficients[best][None], _POLISHING, _FINER * steps)
    q, qd, qdd = _sampled(*given[:3], coefficients[0], _FINER * steps)
    path = SampledPath(q, qd / duration, qdd / duration**2, jnp.asarray(float(duration)))
    return _judged(robot, path, float(errors[0]), settings, reach)


def _window(s: Scalar) -> Scalar:
    """30 s^2 (1 - s)^2: of integral one, zero with its slope at both ends."""
    return 30 * s**2 * (1 - s) ** 2


def _rate(robot: Robot, rows: Array, coefficients: Array, q: Vector, s: Scalar) -> Vector:
    """dq/ds (n,) at a share s of the way."""
    powers = (2 * s - 1) ** jnp.arange(coefficients.shape[1])
    return null_projector(robot, rows, q) @ (coefficients @ powers) * _window(s)


def _integrated(robot: Robot, rows: Array, start: Vector, coefficients: Array, steps: int) -> Array:
    """Positions (steps + 1, n) by Runge-Kutta of order 4."""
    h = 1.0 / steps

    def slope(q, s):
        return _rate(robot, rows, coefficients, q, s)

    def advance(q, s):
        # The four stages are one loop, so that the dynamics is compiled once.
        def stage(carry, inputs):
            last, total = carry
            share, weight = inputs
            k = slope(q + share * h * last, s + share * h)
            return (k, total + weight * k), None

        zero = jnp.zeros_like(q)
        stages = jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0]) / 6
        (_, total), _ = jax.lax.scan(stage, (zero, zero), stages)
        return q + h * total, q

    last, positions = jax.lax.scan(advance, start, h * jnp.arange(steps))
    return jnp.concatenate([positions, last[None]])


def _search(robot, rows, start, goal, first, iterations, steps):
    """Coefficients (k, n, d), end errors (k,) and squared lengths (k,) of the paths from k starts."""

    def one(start, goal, first):
        def miss(flat):
            path = _integrated(robot, rows, start, flat.reshape(first.shape), steps)
            return path[-1] - goal

        def step(carry, _):
            flat, error, damping = carry
            slope = jax.jacrev(miss)(flat)
            square = slope @ slope.T
            spread = damping * jnp.trace(square) / goal.size * jnp.eye(goal.size)
            change = -slope.T @ jnp.linalg.solve(square + spread, error)
            tried = flat + change
            missed = miss(tried)
            better = jnp.sum(missed**2) < jnp.sum(error**2)
            flat, error = jnp.where(better, tried, flat), jnp.where(better, missed, error)
            return (flat, error, jnp.clip(jnp.where(better, damping / 8, damping * 4), 1e-12, 1e6)), None

        flat = first.ravel()
        (flat, error, _), _ = jax.lax.scan(step, (flat, miss(flat), 1e-3), None, length=iterations)
        path = _integrated(robot, rows, start, flat.reshape(first.shape), steps)
        return flat.reshape(first.shape), jnp.max(jnp.abs(error)), jnp.sum(jnp.diff(path, axis=0) ** 2)

    found = jit(jax.vmap(one, (None, None, 0)))(start, goal, first)
    coefficients, errors, lengths = (np.asarray(x) for x in found)
    return coefficients, np.where(np.isfinite(errors), errors, np.inf), lengths


def _sampled(robot, rows, start, coefficients, steps):
    """Positions, and rates and accelerations by the share of the way, (steps + 1, n) each."""

    @jit
    def found(start, coefficients):
        path = _integrated(robot, rows, start, coefficients, steps)
        shares = jnp.linspace(0.0, 1.0, steps + 1)

        def both(q, s):
            rate = _rate(robot, rows, coefficients, q, s)
            along = jax.jvp(
                lambda q, s: _rate(robot, rows, coefficients, q, s), (q, s), (rate, jnp.ones_like(s))
            )
            return along

        return path, *jax.vmap(both)(path, shares)

    return found(start, jnp.asarray(coefficients))


def _judged(
    robot: Robot, path: SampledPath, error: float, settings: ManoeuvreSettings, reach: Reach
) -> Manoeuvre:
    """The path with what a rollout and the robot's limits say of it."""
    still = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), path.joint_position[0])
    motion = jit(lambda path: rollout(robot, path, still, num_steps=2 * _FINER * settings.steps))(path)
    turns = np.linalg.norm(jax.vmap(quaternion_to_rotation_vector)(motion.base_quaternion), axis=-1)
    turn = float(np.max(turns))
    q, rate = np.asarray(motion.joint_grid.joint_position), np.asarray(motion.joint_grid.joint_velocity)
    limits = robot.limits
    outside = np.max(np.maximum(q - limits.position_upper, limits.position_lower - q), axis=0)
    faster = np.max(np.abs(rate), axis=0) / np.asarray(limits.velocity)
    if not turn <= settings.turn or not error <= settings.tolerance:
        code, text = ManoeuvreCode.NOT_VERIFIED, (
            f"not verified: in a rollout of its own the base turns by {turn:.3g} rad, and the path ends {error:.3g}
            from " "the goal; raise steps"
        )
    elif np.any(outside > 0):
        joint = robot.joint_names[int(np.argmax(outside))]
        code, text = ManoeuvreCode.LIMITS_EXCEEDED, (
            f"'{joint}' leaves its range by {np.max(outside):.3g} on the way; try more starts or another goal"
        )
    elif np.any(faster > 1):
        joint = robot.joint_names[int(np.argmax(faster))]
        least = float(path.duration) * float(np.max(faster))
        code, text = ManoeuvreCode.LIMITS_EXCEEDED, (
            f"'{joint}' is {np.max(faster):.3g} times as fast as it may be; the same way takes {least:.4g} s or more"
        )
    else:
        code, text = ManoeuvreCode.FOUND, (
            f"the goal is reached to {error:.2g} while the base turns by {turn:.2g} rad at most"
        )
    return Manoeuvre(code, text, path, error, turn, reach)


def _none(reach: Reach, joints: int, error: float, settings: ManoeuvreSettings) -> Manoeuvre:
    """What to say where no start arrived."""
    if reach.bracket_rank < joints:
        code, text = ManoeuvreCode.ON_A_SURFACE, (
            f"none was found, and most goals have none: the {reach.null_dimension} rates without reaction and their "
            f"brackets of two and three span {reach.bracket_rank} of {joints} dimensions in every posture looked at,
            so that " f"what can be reached is a surface of so many through the start; the nearest arrival is
            {error:.3g} away"
        )
    else:
        code, text = ManoeuvreCode.NOT_FOUND, (
            f"none was found from {settings.starts} starts, though one may exist: brackets of the
            {reach.null_dimension} " f"rates without reaction span all {joints} dimensions; the nearest arrival is
            {error:.3g} away; raise starts, " "degree or iterations, or go by a posture between"
        )
    return Manoeuvre(code, text, None, error, np.nan, reach)


def _posture(robot: Robot, what: str, q: Vector) -> np.ndarray:
    q = np.asarray(q, dtype=float)
    if q.shape != (robot.num_joints,):
        raise InputError(f"{what} has shape {q.shape}; ({robot.num_joints},) is expected")
    if not np.all(np.isfinite(q)):
        raise InputError(f"{what} {q.tolist()} is not finite")
    return q
