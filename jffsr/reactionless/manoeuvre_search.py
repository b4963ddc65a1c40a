"""The search for a zero-reaction path: rates in the null space integrated, their coefficients fitted to the goal."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp

from jffsr.compiling import jit
from jffsr.reactionless.manoeuvre_space import null_projector
from jffsr.robots.robot import Robot
from jffsr.types import Array, Scalar, Vector


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


def _outside(robot: Robot, path: Array) -> Scalar:
    """How far (), rad or m, positions (..., n) leave the joints' ranges at most; not positive where they do not."""
    lower, upper = jnp.asarray(robot.limits.position_lower), jnp.asarray(robot.limits.position_upper)
    return jnp.max(jnp.maximum(path - upper, lower - path))


@partial(jit, static_argnames=("iterations", "steps"))
def search(
    robot: Robot, rows: Array, start: Vector, goal: Vector, first: Array, iterations: int, steps: int
) -> tuple[Array, Array, Array, Array]:
    """Coefficients (k, n, d), end errors (k,), squared lengths (k,) and how far joints leave their ranges (k,), of the
    paths from k first ones."""

    def one(first):
        def miss(flat):
            path = _integrated(robot, rows, start, flat.reshape(first.shape), steps)
            length = jnp.sum(jnp.diff(path, axis=0) ** 2)
            return path[-1] - goal, (path[-1] - goal, jnp.stack([length, _outside(robot, path)]))

        def step(carry, _):
            # The slope is taken where the last one was tried, so that one integration does for both.
            flat, error, slope, sizes, change, damping = carry
            tried = flat + change
            there, (missed, way) = jax.jacfwd(miss, has_aux=True)(tried)
            better = jnp.sum(missed**2) <= jnp.sum(error**2)
            flat, error, slope, sizes = (
                jnp.where(better, new, old)
                for new, old in ((tried, flat), (missed, error), (there, slope), (way, sizes))
            )
            damping = jnp.clip(jnp.where(better, damping / 8, damping * 4), 1e-12, 1e6)
            square = slope @ slope.T
            spread = damping * jnp.trace(square) / goal.size * jnp.eye(goal.size)
            change = -slope.T @ jnp.linalg.solve(square + spread, error)
            return (flat, error, slope, sizes, change, damping), None

        flat = first.ravel()
        nothing = jnp.full_like(goal, jnp.inf), jnp.zeros((goal.size, flat.size)), jnp.zeros(2)
        start_of_search = flat, *nothing, jnp.zeros_like(flat), jnp.asarray(1e-2)
        (flat, error, _, sizes, _, _), _ = jax.lax.scan(step, start_of_search, None, length=iterations + 1)
        return flat.reshape(first.shape), jnp.max(jnp.abs(error)), *sizes

    return jax.vmap(one)(first)


@partial(jit, static_argnames="steps")
def sampled(
    robot: Robot, rows: Array, start: Vector, coefficients: Array, steps: int
) -> tuple[Array, Array, Array]:
    """Positions, and rates and accelerations by the share of the way, (steps + 1, n) each."""

    def rate(q: Vector, s: Scalar) -> Vector:
        return _rate(robot, rows, coefficients, q, s)

    def both(q: Vector, s: Scalar) -> tuple[Vector, Vector]:
        return jax.jvp(rate, (q, s), (rate(q, s), jnp.ones_like(s)))

    path = _integrated(robot, rows, start, coefficients, steps)
    return path, *jax.vmap(both)(path, jnp.linspace(0.0, 1.0, steps + 1))
