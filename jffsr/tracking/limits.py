"""Joint rates inside the limits of position, rate and acceleration, step by step.

Rates are held over a step, so that bounds on them hold between the samples as well. Two rules keep a task inside:
it is scaled down as a whole, its direction kept, or the joints that saturate are fixed and the others take over
(saturation in the null space: Flacco, De Luca and Khatib 2012), with the scaling as the last resort.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp

from jffsr.robots.robot import Limits
from jffsr.tracking.damping import Damping
from jffsr.tracking.inverses import RANK_CUT, filtered_inverse, singular_values
from jffsr.types import Array, Matrix, Scalar, Vector

IGNORE, SCALE, REDISTRIBUTE = "ignore", "scale", "redistribute"
LIMIT_RULES = (IGNORE, SCALE, REDISTRIBUTE)


class Bounded(NamedTuple):
    """Rates (n,) inside their bounds, and the share of the task that they perform, 1 for all of it."""

    rates: Vector
    share: Scalar


def rate_bounds(limits: Limits, position: Vector, last_rate: Vector, step: Scalar) -> tuple[Vector, Vector]:
    """Lower and upper bounds (n,) of the rates held over the next `step`, s.

    None above the rate limit; none that changes the last rate by more than the acceleration limit times the step;
    none that leads past a position limit, at the end of the step or of the shortest braking after it. Where these
    contradict each other, which a start inside all of them excludes, the position counts first.
    """
    change = _finite_times(jnp.asarray(limits.acceleration), step)
    upper_stop = _approach(jnp.asarray(limits.position_upper) - position, change, step)
    lower_stop = -_approach(position - jnp.asarray(limits.position_lower), change, step)
    rate = jnp.asarray(limits.velocity)
    lower = jnp.clip(jnp.maximum(last_rate - change, -rate), lower_stop, upper_stop)
    upper = jnp.clip(jnp.minimum(last_rate + change, rate), lower_stop, upper_stop)
    return lower, jnp.maximum(lower, upper)


def _finite_times(limit: Array, factor: Array) -> Array:
    """limit * factor, infinite where the limit is: without the detour its gradient by the factor would be NaN."""
    finite = jnp.isfinite(limit)
    return jnp.where(finite, jnp.where(finite, limit, 0.0) * factor, jnp.inf)


def _approach(gap: Vector, change: Vector, step: Scalar) -> Vector:
    """Largest rate (n,) towards a limit that is `gap` away, from which steps of -change stop in time.

    Rate v for one step and then v - change, v - 2 change ... cover h ((k + 1) v - change k (k + 1)/2), k being
    the steps until rest: linear in pieces, so that its inverse is exact.
    """
    braked = jnp.isfinite(change) & (change > 0)
    safe_change = jnp.where(braked, change, 1.0)
    there = jnp.isfinite(gap)
    safe_gap = jnp.where(there, gap, 1.0)
    share = jax.lax.stop_gradient(jnp.maximum(safe_gap, 0.0) / (safe_change * step))
    k = jnp.where(braked, jnp.floor(0.5 * (jnp.sqrt(1 + 8 * share) - 1)), 0.0)
    return jnp.where(there, (safe_gap / step + 0.5 * safe_change * k * (k + 1)) / (k + 1), jnp.inf)


def scaled(task: Vector, rest: Vector, lower: Vector, upper: Vector) -> Bounded:
    """rest + share task with the largest share in [0, 1] that the bounds allow; what is left over is cut off."""
    share, _ = task_share(task, rest, lower, upper)
    return Bounded(jnp.clip(rest + share * task, lower, upper), share)


def task_share(task: Vector, rest: Vector, lower: Vector, upper: Vector) -> tuple[Scalar, Array]:
    """The largest share in [0, 1] for which rest + share task is inside, and the joint that decides it."""
    room = jnp.where(task > 0, upper - rest, lower - rest)
    # Infinite room is left out before it is divided, which would make the gradient NaN.
    bounded = (task != 0) & jnp.isfinite(room)
    each = jnp.where(bounded, jnp.where(bounded, room, 1.0) / jnp.where(bounded, task, 1.0), jnp.inf)
    joint = jnp.argmin(each)
    return jnp.clip(each[joint], 0.0, 1.0), joint


def redistributed(
    jacobian: Matrix,
    velocity: Vector,
    drift: Vector,
    rest: Vector,
    lower: Vector,
    upper: Vector,
    damping: Damping,
) -> Bounded:
    """Rates (n,) for a task velocity (m,) with saturated joints fixed at their bounds and the others moved more.

    jacobian (m, n); drift (m,) is a task velocity that comes without the joints and is made up for before the task;
    rest (n,) are rates wanted beside the task, in its null space. The joints are fixed one after
    another, the most critical first, while those left still span the task; if that does not do, the set that
    performed the largest share of the task is taken, and the task scaled (Flacco et al. 2012, algorithm 1).
    """
    n = jacobian.shape[1]
    jacobian, lower, upper = jnp.asarray(jacobian), jnp.asarray(lower), jnp.asarray(upper)
    rank = _rank(jacobian)

    def one(carry, _):
        free, fixed, best, done = carry
        weighted = jacobian * free
        inverse = filtered_inverse(weighted, damping)
        task = free * (inverse @ velocity)
        taken = drift + jacobian @ (free * rest + (1 - free) * fixed)
        other = free * (rest - inverse @ taken)
        other = other + (1 - free) * fixed
        inside = jnp.all((task + other >= lower) & (task + other <= upper))
        share, joint = task_share(task, other, lower, upper)
        amount = jnp.where(inside, 1.0, share)
        # Rates that are outside at any share count least; the first of them are taken, and cut off, if there are no
        # others.
        rates = other + amount * task
        merit = jnp.where(jnp.all((rates >= lower - _SLACK) & (rates <= upper + _SLACK)), amount, -1.0)
        better = (~done) & (merit > best.share)
        best = Bounded(jnp.where(better, rates, best.rates), jnp.where(better, merit, best.share))
        reach = (task + other)[joint]
        bound = jnp.where(reach > upper[joint], upper[joint], lower[joint])
        chosen = jnp.arange(n) == joint
        free, fixed = jnp.where(chosen, 0.0, free), jnp.where(chosen, bound, fixed)
        done = done | inside | (_rank(jacobian * free) < rank)
        return (free, fixed, best, done), None

    nothing = Bounded(jnp.clip(rest, lower, upper), jnp.full((), -2.0))
    start = (jnp.ones(n), jnp.zeros(n), nothing, jnp.zeros((), dtype=bool))
    (_, _, best, _), _ = jax.lax.scan(one, start, None, length=n)
    return Bounded(jnp.clip(best.rates, lower, upper), jnp.clip(best.share, 0.0, 1.0))


# Rates that miss a bound by less are inside but for rounding, and are cut off.
_SLACK = 1e-12
_RANK_SHARE = 1e4 * RANK_CUT


def _rank(jacobian: Matrix) -> Array:
    sigma = singular_values(jax.lax.stop_gradient(jacobian))
    return jnp.sum(sigma > _RANK_SHARE * sigma[0])
