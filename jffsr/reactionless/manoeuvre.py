"""Zero-reaction manoeuvres: from one posture to another with the base's attitude kept all the way, if there is a way.

Without momentum the rates qd = N(q) zeta(t) turn the base nowhere, N being the projector on the coupling's null space
(Nenchev, Umetani and Yoshida 1992; Dimitrov and Yoshida 2004). zeta is a smooth window, zero with its slope at both
ends, times polynomials whose coefficients bring the integral from the start to the goal: least-norm steps of Levenberg
and Marquardt on the end's error, from several starts at once. What stands still does so exactly, whatever the
coefficients are; only the arrival is searched for.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from enum import IntEnum
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.reactionless.manoeuvre_path import SampledPath
from jffsr.reactionless.manoeuvre_search import sampled, search
from jffsr.reactionless.manoeuvre_space import Reach, coupling_rows, reach_of
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.rollout import check_steps, rollout
from jffsr.spatial.rotation import quaternion_to_rotation_vector
from jffsr.types import Array, Vector

# The path's steps are that many times as fine as the search's, and this many iterations bring it to its end again.
_FINER, _POLISHING = 4, 12


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
    coefficients; iterations: of each; steps: of the search's integration, a quarter of the path's; pieces: into as
    many, by postures on the straight line to the goal, the way may be cut where a longer one is not found; tolerance,
    rad or m: of the goal; turn, rad: largest rotation of the base in the rollout that verifies."""

    degree: int = 4
    starts: int = 6
    scatter: float = 1.0
    iterations: int = 80
    steps: int = 40
    pieces: int = 8
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
    check_steps(settings.steps)
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
    pieces, nearest, outside = 1, np.inf, None
    while pieces <= settings.pieces:
        stops = start + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (goal - start)
        ways = []
        for here, there in itertools.pairwise(stops):
            way, error = _piece(robot, jnp.asarray(rows), here, there, settings, key)
            if way is None:
                break
            ways.append(way)
        if len(ways) == pieces:
            found = _judged(robot, _joined(ways, float(duration)), goal, settings)
            if found.success or pieces == settings.pieces:
                return found
            outside = found
        nearest = error if pieces == 1 else nearest
        # Shorter pieces take smaller loops.
        pieces *= 2
    return outside or _none(reach_of(robot, rows, postures), robot.num_joints, nearest, settings)


def _piece(
    robot: Robot,
    rows: Array,
    start: np.ndarray,
    goal: np.ndarray,
    settings: ManoeuvreSettings,
    key: Array,
) -> tuple[tuple[Array, Array, Array] | None, float]:
    """Samples of a path as `sampled` gives them, None if none is found, and the nearest arrival."""
    shape, steps = (settings.starts, robot.num_joints, settings.degree + 1), settings.steps
    # The first goes straight, as far as the null space lets it.
    first = settings.scatter * jax.random.normal(key, shape).at[0].set(0.0)
    first = first.at[:, :, 0].add(goal - start)
    given = robot, rows, jnp.asarray(start)
    coefficients, errors, lengths, outside = search(
        *given, jnp.asarray(goal), first, settings.iterations, steps
    )
    errors = np.where(np.isfinite(errors), errors, np.inf)
    arrived = errors <= settings.tolerance
    if not np.any(arrived):
        return None, float(np.min(errors))
    # Of those that arrive one inside the ranges, and of these the shortest.
    inside = arrived & (np.asarray(outside) <= 0)
    best = int(np.argmin(np.where(inside if np.any(inside) else arrived, lengths, np.inf)))
    # Finer steps: between its samples a path is only as still as they are consistent with each other.
    polished, missed, _, _ = search(
        *given, jnp.asarray(goal), coefficients[best][None], _POLISHING, _FINER * steps
    )
    if not missed[0] <= settings.tolerance:
        return None, float(missed[0])
    return sampled(*given, polished[0], _FINER * steps), float(missed[0])


def _joined(ways: list[tuple[Array, Array, Array]], duration: float) -> SampledPath:
    """Ways in a row, at rest between, each taking the same share of the duration, s."""
    rate = len(ways) / duration
    positions, rates, accelerations = (
        jnp.concatenate([x[: None if k == len(ways) - 1 else -1] for k, x in enumerate(part)])
        for part in zip(*ways, strict=True)
    )
    return SampledPath(positions, rate * rates, rate**2 * accelerations, jnp.asarray(duration))


@partial(jit, static_argnames="steps")
def _followed(robot: Robot, path: SampledPath, steps: int) -> Motion:
    """The path in a rollout under no momentum, which knows the joints' motion only."""
    still = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), path.joint_position[0])
    return rollout(robot, path, still, num_steps=steps)


def _judged(robot: Robot, path: SampledPath, goal: np.ndarray, settings: ManoeuvreSettings) -> Manoeuvre:
    """The path with what a rollout and the robot's limits say of it."""
    error = float(np.max(np.abs(np.asarray(path.joint_position[-1]) - goal)))
    motion = _followed(robot, path, 2 * (len(path.joint_position) - 1))
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
                f"none was found from {settings.starts} starts in up to {settings.pieces} pieces, but one may exist: "
                f"{of} span all {joints} dimensions; {nearest}; raise starts, degree or iterations"
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
