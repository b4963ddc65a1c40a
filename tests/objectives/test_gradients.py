"""Gradients of the index at random and degenerate points, against finite differences of order 8.

Every point is a problem of its own (other limits, goals, momenta), stacked and evaluated in one call. All six
terms are on, and the duration is free.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wu6_problems import START, limited, wu6_problem

from jffsr.objectives.terms import attitude_angles
from jffsr.planning.problem import Problem

NUM_RANDOM = 100
TURNED = np.array([0.96, 0.16, -0.2, 0.12]) / np.linalg.norm([0.96, 0.16, -0.2, 0.12])

# Weights of f(x + k h) - f(x - k h), k = 1 to 4, to be divided by h: order 8.
WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
STEP = 2e-5


@dataclass(frozen=True)
class Points:
    """Names, stacked problems and candidates (K, d)."""

    names: list[str]
    problems: Problem
    candidates: np.ndarray


def problem_of(robot, **changes) -> Problem:
    settings = {
        "goal_quaternion": TURNED,
        "attitude_change": np.deg2rad(0.1),
        "tool_position": 1e-3,
        "duration_bounds": (5.0, 60.0),
    }
    return wu6_problem(robot, num_steps=12, **(settings | changes))


def with_term(problem: Problem, name: str, **changes) -> Problem:
    """The problem with some numbers of one term of its index exchanged."""
    terms = tuple(replace(t, **changes) if t.name == name else t for t in problem.objective.terms)
    return replace(problem, objective=replace(problem.objective, terms=terms))


def stacked(problems: list[Problem]) -> Problem:
    return jax.tree.map(lambda *x: jnp.stack([jnp.asarray(y, dtype=float) for y in x]), *problems)


motion_of = jax.jit(lambda problem, z: problem.motion(z))


@jax.jit
def smooth_of(problems: Problem, candidates):
    """The smooth index (K,) and its gradient (K, d)."""
    return jax.vmap(jax.value_and_grad(lambda z, p: p.smooth_and_value(z)[0]))(candidates, problems)


@jax.jit
def published_of(problems: Problem, candidates):
    """The published index (K,) and its gradient (K, d)."""
    return jax.vmap(jax.value_and_grad(lambda z, p: p.smooth_and_value(z)[1]))(candidates, problems)


def momentum_that_turns_by_180_deg(problem: Problem, z, axis) -> np.ndarray:
    """Angular momentum along `axis` at which the base has turned by 180 degrees at the end, by bisection."""

    def cosine_of_half(size):
        turned = replace(problem, momentum=np.concatenate([np.zeros(3), size * axis]))
        q = np.asarray(motion_of(turned, z).base_quaternion)
        return np.dot(q[0], q[-1])

    low, high = 0.0, 60.0
    assert cosine_of_half(low) > 0 > cosine_of_half(high)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if cosine_of_half(middle) > 0 else (low, middle)
    assert abs(cosine_of_half(low)) < 1e-13
    return np.concatenate([np.zeros(3), low * axis])


def degenerate_points(robot, z) -> dict[str, tuple[Problem, np.ndarray]]:
    """The twenty points where an index is likely to have no gradient, or NaN; z (13,) is an ordinary point."""
    base = problem_of(robot)
    motion = motion_of(base, z)
    end = np.asarray(motion.base_quaternion)[-1]
    rate = np.abs(np.asarray(motion.joint_grid.joint_velocity)).max(axis=0)
    acceleration = np.abs(np.asarray(motion.joint_grid.joint_acceleration)).max(axis=0)
    angles = np.abs(np.asarray(attitude_angles(motion, "rotation_vector"))).max(axis=0)
    still = np.concatenate([np.zeros(12), [30.0]])
    at_rest = problem_of(robot, goal=START)
    opposite = np.array([-end[1], end[0], -end[3], end[2]])  # half a turn from where it ends
    goal_met = with_term(base, "goal_attitude", goal=end)
    axes = np.eye(3)
    tilted = np.array([0.6, -0.64, 0.48])
    corner = np.concatenate([np.full(12, np.pi), [60.0]])
    mixed = np.concatenate([np.tile([-np.pi, np.pi], 6), [5.0]])

    def tumbling(axis):
        return replace(base, momentum=momentum_that_turns_by_180_deg(base, z, axis))

    points = {
        "goal attitude met": (goal_met, z),
        "goal attitude and tool position met": (with_term(goal_met, "tool_position", attitude=end), z),
        "goal attitude met with the opposite sign": (with_term(base, "goal_attitude", goal=-end), z),
        "peak rates at their limits": (with_term(base, "joint_rate", limit=rate), z),
        "peak accelerations at their limits": (with_term(base, "joint_acceleration", limit=acceleration), z),
        "excursion at its limits": (with_term(base, "attitude_excursion", limit=angles), z),
        "everything at its limits": (
            with_term(
                with_term(
                    with_term(base, "joint_rate", limit=rate), "joint_acceleration", limit=acceleration
                ),
                "attitude_excursion",
                limit=angles,
            ),
            z,
        ),
        "no limits": (
            with_term(
                with_term(base, "joint_rate", limit=np.full(6, np.inf)),
                "attitude_excursion",
                limit=np.full(3, np.inf),
            ),
            z,
        ),
        "no motion": (at_rest, still),
        "no motion, every goal met": (
            with_term(
                with_term(at_rest, "goal_attitude", goal=np.eye(4)[0]), "tool_position", attitude=np.eye(4)[0]
            ),
            still,
        ),
        "no joint motion, but momentum": (
            replace(at_rest, momentum=np.array([1.0, -2.0, 0.5, 0.3, 0.2, -0.4])),
            still,
        ),
        "zero coefficients": (base, still),
        "on the upper bounds": (base, corner),
        "on the lower bounds": (base, np.concatenate([np.full(12, -np.pi), [5.0]])),
        "on bounds of both kinds": (base, mixed),
        "180 degrees from the goal attitude": (with_term(base, "goal_attitude", goal=opposite), z),
        "turned by 180 degrees about x": (tumbling(axes[0]), z),
        "turned by 180 degrees about z": (tumbling(axes[2]), z),
        "turned by 180 degrees about no axis": (tumbling(tilted), z),
        "no motion of the joints, start near a limit": (
            problem_of(limited(robot, position=211.0), start=START, goal=START),
            still,
        ),
    }
    assert len(points) == 20
    return points


@pytest.fixture(scope="module")
def points(robots) -> Points:
    robot = limited(robots["wu_2018_6dof"])
    rng = np.random.default_rng(20)
    candidates = rng.uniform(-np.pi, np.pi, (NUM_RANDOM, 13))
    candidates[:, 12] = rng.uniform(5.0, 60.0, NUM_RANDOM)
    problems, names = [], []
    for k in range(NUM_RANDOM):
        # A third of the points under momentum, so that the base turns far as well.
        momentum = rng.normal(size=6) * (20.0 if k % 3 == 0 else 0.0)
        problems.append(problem_of(robot, momentum=momentum))
        names.append(f"random point {k}")
    degenerate = degenerate_points(robot, np.concatenate([0.3 * candidates[0, :12], [30.0]]))
    for name, (problem, z) in degenerate.items():
        names.append(name)
        problems.append(problem)
        candidates = np.concatenate([candidates, z[None]])
    return Points(names, stacked(problems), candidates)


@pytest.fixture(scope="module")
def smooth(points) -> tuple[np.ndarray, np.ndarray]:
    value, gradient = smooth_of(points.problems, points.candidates)
    return np.asarray(value), np.asarray(gradient)


@pytest.fixture(scope="module")
def published(points) -> tuple[np.ndarray, np.ndarray]:
    value, gradient = published_of(points.problems, points.candidates)
    return np.asarray(value), np.asarray(gradient)


def finite_differences(points: Points) -> np.ndarray:
    """Gradients (K, d); the step is short against every rounding of the index."""
    count, size = points.candidates.shape
    multiples = np.concatenate([np.arange(1, 5), -np.arange(1, 5)])
    shifts = STEP * np.einsum("m,ij->imj", multiples, np.eye(size)).reshape(-1, size)
    # By the program that gives the gradients as well: another one would first have to be compiled.
    values = np.stack([smooth_of(points.problems, points.candidates + shift)[0] for shift in shifts], axis=1)
    values = values.reshape(count, size, 2, 4)
    return (values[:, :, 0] - values[:, :, 1]) @ WEIGHTS / STEP


def test_smooth_gradient_agrees_with_finite_differences(points, smooth):
    _, gradient = smooth
    assert np.all(np.isfinite(gradient))
    error = np.linalg.norm(gradient - finite_differences(points), axis=1)
    allowed = 1e-6 * np.maximum(1.0, np.linalg.norm(gradient, axis=1))
    bad = [f"{points.names[k]}: {error[k]:.3g} > {allowed[k]:.3g}" for k in np.flatnonzero(error > allowed)]
    assert not bad, "; ".join(bad)


def test_smooth_gradient_vanishes_where_everything_is_met(points, smooth):
    """At rest with every goal met."""
    k = points.names.index("no motion, every goal met")
    assert np.linalg.norm(smooth[1][k]) < 1e-9


@pytest.mark.slow
def test_published_gradient_is_finite_everywhere(points, published):
    value, gradient = published
    assert np.all(np.isfinite(value))
    bad = [points.names[k] for k in np.flatnonzero(~np.isfinite(gradient).all(axis=1))]
    assert not bad, f"gradient of the published index is not finite at: {bad}"


@pytest.mark.slow
def test_published_index_is_zero_where_everything_is_met(points, published):
    k = points.names.index("no motion, every goal met")
    assert published[0][k] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_smooth_index_is_never_far_below_the_published_one(points, smooth, published):
    """A rounded norm lies at most its width under the plain one, once at zero and once at 180 degrees.

    The excursion is rounded at 180 degrees as well, by 2 * 2e-3 rad for each axis.
    """
    norms = 4 * 0.5
    excursion = 3 * 2 * 2e-3 / np.deg2rad(10) / 0.01
    far = np.array(["180" in name or "random" in name for name in points.names])
    assert np.all(smooth[0] >= published[0] - norms - np.where(far, excursion, 1e-2))
