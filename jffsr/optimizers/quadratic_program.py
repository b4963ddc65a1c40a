"""A small convex quadratic program whose rows may be missed at a price, by a primal-dual interior point method.

    min over d in [lower, upper] of  g'd + d'Hd/2 + sum_i w_i v_i(a_i'd + c_i),

v(r) = |r| for an equality and max(0, r) for an inequality: with weights above the multipliers the rows are kept
exactly where they can be, and there always is a solution (Fletcher, "Practical Methods of Optimization", 1987,
section 14.3). A row's multiplier z lies between -w (equality) or 0 (inequality) and w; with the parts s and t of
r = s - t, what is solved by Newton steps is

    H d + g + A'z - z_lower + z_upper = 0,  t (z - least) = m,  s (w - z) = m,

and the same of the bounds, while m goes to zero (Nocedal and Wright, "Numerical Optimization", 2nd edition, 16.6).
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jffsr.types import Array, Scalar, Vector

_NEAR_BOUND = 0.995
_CENTRING, _SAFE_CENTRING = 0.1, 0.5
_LEAST_PRODUCT, _ROUNDING = 1e-12, 1e-12


class QuadraticStep(NamedTuple):
    """The minimiser (d,), the rows' multipliers (r,), and how far the conditions are still missed."""

    step: Vector
    multiplier: Vector
    miss: Scalar


class _Point(NamedTuple):
    """Step, and what must stay above zero: distances from both bounds follow from it, and their multipliers, parts
    of the rows; the rows' multipliers lie between theirs."""

    step: Vector
    at_lower: Vector
    at_upper: Vector
    z: Vector
    below: Vector
    above: Vector
    centring: Scalar


def quadratic_step(
    hessian: Array,
    gradient: Vector,
    matrix: Array,
    offset: Vector,
    is_equality: Array,
    lower: Vector,
    upper: Vector,
    weight: Vector,
    iterations: int = 30,
) -> QuadraticStep:
    """The program's solution, for jit and vmap.

    hessian (d, d), positive definite; gradient (d,); matrix (r, d) and offset (r,) of the rows; is_equality (r,);
    lower < upper (d,); weight (r,), above zero. Always does the same number of iterations.
    """
    least = jnp.where(is_equality, -weight, 0.0)
    middle = (lower + upper) / 2
    # Near the path that leads to the solution, where all products are alike.
    half = (upper - lower) / 2
    width = jnp.mean(half)
    at_middle = matrix @ middle + offset
    force = jnp.max(jnp.abs(gradient)) + width * jnp.max(jnp.abs(hessian))
    product = 0.1 * width * force
    # Lest rows that are all but met outweigh the Hessian beyond what numbers can hold; it only slows the multipliers.
    rounding = _ROUNDING * jnp.sum(matrix**2, axis=1) / jnp.mean(jnp.diag(hessian)) + 1e-300
    z = jnp.where(is_equality, 0.0, jnp.minimum(weight / 2, force))
    start = _Point(
        middle,
        product / half,
        product / half,
        z,
        jnp.maximum(product / (z - least), jnp.maximum(-at_middle, 1e-3 * width)),
        jnp.maximum(product / (weight - z), jnp.maximum(at_middle, 1e-3 * width)),
        jnp.asarray(_SAFE_CENTRING),
    )

    def missed(p: _Point):
        dual = hessian @ p.step + gradient + matrix.T @ p.z - p.at_lower + p.at_upper
        rows = matrix @ p.step + offset + p.below - p.above
        return dual, rows

    def gap(p: _Point) -> Scalar:
        products = _products(p, least, weight, lower, upper)
        return sum(jnp.sum(x) for x in products) / sum(x.size for x in products)

    def turn(_, p: _Point) -> _Point:
        m = jnp.maximum(p.centring * gap(p), _LEAST_PRODUCT * product)
        dual, rows = missed(p)
        from_least, to_weight = p.z - least, weight - p.z
        from_lower, to_upper = p.step - lower, upper - p.step
        spread = p.below / from_least + p.above / to_weight + rounding
        moved = rows + (m / from_least - p.below) - (m / to_weight - p.above)
        push = (m / from_lower - p.at_lower) - (m / to_upper - p.at_upper)
        scaled = matrix / spread[:, None]
        curved = hessian + matrix.T @ scaled + jnp.diag(p.at_lower / from_lower + p.at_upper / to_upper)
        d_step = jax.scipy.linalg.cho_solve(
            jax.scipy.linalg.cho_factor(curved), -dual - scaled.T @ moved + push
        )
        d_z = (matrix @ d_step + moved) / spread
        d_below = m / from_least - p.below - p.below / from_least * d_z
        d_above = m / to_weight - p.above + p.above / to_weight * d_z
        d_lower = m / from_lower - p.at_lower - p.at_lower / from_lower * d_step
        d_upper = m / to_upper - p.at_upper + p.at_upper / to_upper * d_step
        positive = (
            (from_least, d_z),
            (to_weight, -d_z),
            (from_lower, d_step),
            (to_upper, -d_step),
            (p.below, d_below),
            (p.above, d_above),
            (p.at_lower, d_lower),
            (p.at_upper, d_upper),
        )
        share = jnp.minimum(1.0, _NEAR_BOUND * jnp.min(jnp.stack([_room(x, dx) for x, dx in positive])))
        share = jnp.where(jnp.isfinite(share), share, 0.0)
        changes = (d_step, d_lower, d_upper, d_z, d_below, d_above)
        # Beyond what rounding lets be solved a step may be no number: then the point stays.
        sound = jnp.all(jnp.array([jnp.all(jnp.isfinite(x)) for x in changes]))
        following = [jnp.where(sound, old + share * dx, old) for old, dx in zip(p[:-1], changes, strict=True)]
        return _Point(*following, jnp.where(share > 0.9, _CENTRING, _SAFE_CENTRING))

    end = jax.lax.fori_loop(0, iterations, turn, start)
    dual, rows = missed(end)
    miss = jnp.maximum(jnp.max(jnp.abs(dual)), jnp.max(jnp.abs(rows), initial=0.0))
    return QuadraticStep(end.step, end.z, jnp.maximum(miss, gap(end)))


def _products(p: _Point, least: Vector, weight: Vector, lower: Vector, upper: Vector):
    """What goes to zero: each distance times its multiplier."""
    return (
        p.below * (p.z - least),
        p.above * (weight - p.z),
        p.at_lower * (p.step - lower),
        p.at_upper * (upper - p.step),
    )


def _room(x: Vector, change: Vector) -> Scalar:
    """The share of the change that brings the first of x > 0 to zero."""
    falling = change < 0
    return jnp.min(jnp.where(falling, x / jnp.where(falling, -change, 1.0), jnp.inf), initial=jnp.inf)
