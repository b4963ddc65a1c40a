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
from functools import partial

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
    coefficients; iterations: of each; steps: of the integration; tolerance, rad or m: of the goal; turn, rad: largest
    rotation of the base in the rollout that verifies."""

    degree: int = 4
    starts: int = 6
    scatter: float = 1.0
    iterations: int = 80
    steps: int = 160
    tolerance: float = 1e-8
    turn: float = 1e-6


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
    reach: Reach | None = None

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
    apart = float(np.max(np.abs(goal - start)))
    if len(rows) >= robot.num_joints and apart > settings.tolerance:
        text = (
            f"none can exist: {robot.num_joints} joints have no rates that leave the base alone, for the coupling "
            f"has rank {len(rows)}; use an arm with more joints"
        )
        return Manoeuvre(ManoeuvreCode.NO_NULL_SPACE, text, None, apart, np.nan, Reach(0, 0))
    key = jax.random.PRNGKey(0) if key is None else key
    shape = (settings.starts, robot.num_joints, settings.degree + 1)
    # The first goes straight, as far as the null space lets it.
    first = settings.scatter * jax.random.normal(key, shape).at[0].set(0.0)
    first = first.at[:, :, 0].add(goal - start)
    given = robot, jnp.asarray(rows), jnp.asarray(start)
    found = _search(*given, jnp.asarray(goal), first, settings.iterations, steps)
    coefficients, errors, lengths = (np.asarray(x) for x in found)
    errors = np.where(np.isfinite(errors), errors, np.inf)
    arrived = errors <= settings.tolerance
    if not np.any(arrived):
        reach = reach_of(robot, rows, postures)
        return _none(reach, robot.num_joints, float(np.min(errors)), settings)
    best = int(np.argmin(np.where(arrived, lengths, np.inf)))
    q, qd, qdd = _sampled(*given, jnp.asarray(coefficients[best]), steps)
    path = SampledPath(q, qd / duration, qdd / duration**2, jnp.asarray(float(duration)))
    return _judged(robot, path, float(errors[best]), settings)


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


@partial(jit, static_argnames=("iterations", "steps"))
def _search(
    robot: Robot, rows: Array, start: Vector, goal: Vector, first: Array, iterations: int, steps: int
) -> tuple[Array, Array, Array]:
    """Coefficients (k, n, d), end errors (k,) and squared lengths (k,) of the paths from k first ones."""

    def one(first):
        def miss(flat):
            path = _integrated(robot, rows, start, flat.reshape(first.shape), steps)
            return path[-1] - goal, (path[-1] - goal, jnp.sum(jnp.diff(path, axis=0) ** 2))

        def step(carry, _):
            # The slope is taken where the last one was tried, so that one integration does for both.
            flat, error, slope, length, change, damping = carry
            tried = flat + change
            there, (missed, way) = jax.jacfwd(miss, has_aux=True)(tried)
            better = jnp.sum(missed**2) <= jnp.sum(error**2)
            flat, error, slope, length = (
                jnp.where(better, new, old)
                for new, old in ((tried, flat), (missed, error), (there, slope), (way, length))
            )
            damping = jnp.clip(jnp.where(better, damping / 8, damping * 4), 1e-12, 1e6)
            square = slope @ slope.T
            spread = damping * jnp.trace(square) / goal.size * jnp.eye(goal.size)
            change = -slope.T @ jnp.linalg.solve(square + spread, error)
            return (flat, error, slope, length, change, damping), None

        flat = first.ravel()
        nothing = jnp.full_like(goal, jnp.inf), jnp.zeros((goal.size, flat.size)), jnp.zeros(())
        start_of_search = flat, *nothing, jnp.zeros_like(flat), jnp.asarray(1e-2)
        (flat, error, _, length, _, _), _ = jax.lax.scan(step, start_of_search, None, length=iterations + 1)
        return flat.reshape(first.shape), jnp.max(jnp.abs(error)), length

    return jax.vmap(one)(first)


@partial(jit, static_argnames="steps")
def _sampled(
    robot: Robot, rows: Array, start: Vector, coefficients: Array, steps: int
) -> tuple[Array, Array, Array]:
    """Positions, and rates and accelerations by the share of the way, (steps + 1, n) each."""

    def rate(q: Vector, s: Scalar) -> Vector:
        return _rate(robot, rows, coefficients, q, s)

    def both(q: Vector, s: Scalar) -> tuple[Vector, Vector]:
        return jax.jvp(rate, (q, s), (rate(q, s), jnp.ones_like(s)))

    path = _integrated(robot, rows, start, coefficients, steps)
    return path, *jax.vmap(both)(path, jnp.linspace(0.0, 1.0, steps + 1))


def _judged(robot: Robot, path: SampledPath, error: float, settings: ManoeuvreSettings) -> Manoeuvre:
    """The path with what a rollout and the robot's limits say of it."""
    still = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), path.joint_position[0])
    motion = jit(lambda path: rollout(robot, path, still, num_steps=2 * settings.steps))(path)
    turns = np.linalg.norm(jax.vmap(quaternion_to_rotation_vector)(motion.base_quaternion), axis=-1)
    turn = float(np.max(turns))
    q, rate = np.asarray(motion.joint_grid.joint_position), np.asarray(motion.joint_grid.joint_velocity)
    limits = robot.limits
    outside = np.max(np.maximum(q - limits.position_upper, limits.position_lower - q), axis=0)
    faster = np.max(np.abs(rate), axis=0) / np.asarray(limits.velocity)
    if not turn <= settings.turn or not error <= settings.tolerance:
        code, text = (
            ManoeuvreCode.NOT_VERIFIED,
            (
                f"not verified: in a rollout of its own the base turns by {turn:.3g} rad, and the path ends "
                f"{error:.3g} from the goal; raise steps"
            ),
        )
    elif np.any(outside > 0):
        joint = robot.joint_names[int(np.argmax(outside))]
        code, text = (
            ManoeuvreCode.LIMITS_EXCEEDED,
            (
                f"'{joint}' leaves its range by {np.max(outside):.3g} on the way; try more starts or another goal"
            ),
        )
    elif np.any(faster > 1):
        joint = robot.joint_names[int(np.argmax(faster))]
        least = float(path.duration) * float(np.max(faster))
        code, text = (
            ManoeuvreCode.LIMITS_EXCEEDED,
            (f"'{joint}' is {np.max(faster):.3g} times as fast as it may be; allow {least:.4g} s or more"),
        )
    else:
        code, text = (
            ManoeuvreCode.FOUND,
            (f"the goal is reached to {error:.2g} while the base turns by {turn:.2g} rad at most"),
        )
    return Manoeuvre(code, text, path, error, turn)


def _none(reach: Reach, joints: int, error: float, settings: ManoeuvreSettings) -> Manoeuvre:
    """What to say where no start arrived."""
    of = f"the {reach.null_dimension} rates without reaction and their brackets of two and three"
    nearest = f"the nearest arrival is {error:.3g} away"
    if reach.bracket_rank < joints:
        code, text = (
            ManoeuvreCode.ON_A_SURFACE,
            (
                f"none was found, and most goals have none: {of} span {reach.bracket_rank} of {joints} dimensions in "
                f"every posture looked at, so that a surface of so many through the start is all there is; {nearest}"
            ),
        )
    else:
        code, text = (
            ManoeuvreCode.NOT_FOUND,
            (
                f"none was found from {settings.starts} starts, though one may exist: {of} span all {joints} "
                f"dimensions; {nearest}; raise starts, degree or iterations, or go by a posture between"
            ),
        )
    return Manoeuvre(code, text, None, error, np.nan, reach)


def _posture(robot: Robot, what: str, q: Vector) -> np.ndarray:
    q = np.asarray(q, dtype=float)
    if q.shape != (robot.num_joints,):
        raise InputError(f"{what} has shape {q.shape}; ({robot.num_joints},) is expected")
    if not np.all(np.isfinite(q)):
        raise InputError(f"{what} {q.tolist()} is not finite")
    return q
