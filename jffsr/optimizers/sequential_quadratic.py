"""Sequential quadratic programming: an objective made less while the constraints are kept, from several starts.

At each point a quadratic model of the Lagrangian is made least under the linearised constraints, inside the box and a
trust region; rows that cannot be kept are missed at a price, so that there always is a step (Fletcher, 1987, section
14.4, whose merit function it is, too). The model's Hessian is that of Broyden, Fletcher, Goldfarb and Shanno, damped
by Powell's rule; a step that the constraints' curvature spoils is tried once more with it corrected for. One trial
costs one forward derivative of objective and constraints: as much as a step of the restoration. Numbers are scaled by
the widths of the box.

After `steps` trials, or where the model promises nothing more, the objective is left out, and the point goes the
shortest way to where all constraints are kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp

from jffsr.optimizers.constraints import ConstrainedProblem, merit
from jffsr.optimizers.gradient import select
from jffsr.optimizers.hyperparameters import number
from jffsr.optimizers.interface import (
    Population,
    Progress,
    after_trials,
    finite_or_inf,
    no_progress,
    sample_box,
)
from jffsr.optimizers.quadratic_program import quadratic_step
from jffsr.parallel.mapping import evaluate
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

_ACCEPT, _GOOD = 1e-4, 0.75
_PROMISE = 1e-9
_LEAST_RADIUS, _LARGEST_RADIUS = 1e-9, 0.3
_STIFF = 1e3
_CLOSING_STEPS, _CLOSING_RADIUS = 15, 0.02


@register_dataclass
@dataclass(frozen=True)
class Local:
    """What one trial tells: value of the objective (), its gradient (d,), rows (r,), equalities first, and their
    Jacobian (r, d), by scaled numbers; the merit by Deb's rules; whether every constraint is kept."""

    value: Array
    gradient: Array
    rows: Array
    jacobian: Array
    merit: Array
    kept: Array


@register_dataclass
@dataclass(frozen=True)
class Searches:
    """A batch of starts (k, ...): the point accepted last, in scaled numbers, and what is known there; the model's
    Hessian, multipliers and prices of the rows; the step to the trial that comes next, what the model promised of it,
    and whether it is a corrected one; radius of the trust region; best points so far and merits; whether the
    constraints alone are looked at, and for how many steps; whether a start is under way."""

    point: Array
    local: Local
    hessian: Array
    multiplier: Array
    price: Array
    step: Array
    promise: Array
    corrected: Array
    radius: Array
    best_position: Array
    best_value: Array
    closing: Array
    closed: Array
    active: Array


@register_dataclass
@dataclass(frozen=True)
class SequentialState:
    """The searches, and the progress of all."""

    searches: Searches
    progress: Progress


@register_dataclass
@dataclass(frozen=True)
class SequentialQuadratic:
    """Steps of sequential quadratic programming from `starts` (static) points.

    The starts are the best of a given population, else uniform in the box. steps: trials that look at the objective;
    inside: how far below zero inequalities are driven; radius of the first trust region, in box widths. A start that
    has no finite value ends at once.
    """

    steps: Array | float = number(60, 0)
    inside: Array | float = number(1e-4, 0)
    radius: Array | float = number(0.02, 0, 1, inside=True)
    starts: int = field(default=4, metadata={"static": True})

    def init(
        self, key: Array, problem: ConstrainedProblem, population: Population | None = None
    ) -> SequentialState:
        """The starts; nothing is evaluated yet: the first trial is the start itself."""
        if population is None:
            points, values = sample_box(key, problem, self.starts), jnp.full(self.starts, jnp.inf)
        else:
            values = finite_or_inf(population.values)
            order = jnp.argsort(values)[: self.starts]
            points, values = jnp.asarray(population.positions)[order], values[order]
        count, size = points.shape
        lower, width = _scale(problem)
        shape = jax.eval_shape(problem.evaluation, points[0], jnp.ones(()))
        rows = shape.equality.shape[0] + shape.inequality.shape[0]
        zero = jnp.zeros(count)
        local = Local(
            value=jnp.full(count, jnp.inf),
            gradient=jnp.zeros((count, size)),
            rows=jnp.zeros((count, rows)),
            jacobian=jnp.zeros((count, rows, size)),
            merit=jnp.full(count, jnp.inf),
            kept=zero > 0,
        )
        searches = Searches(
            point=(points - lower) / jnp.where(width > 0, width, 1.0),
            local=local,
            hessian=jnp.tile(jnp.eye(size), (count, 1, 1)),
            multiplier=jnp.zeros((count, rows)),
            price=jnp.zeros((count, rows)),
            step=jnp.zeros((count, size)),
            promise=zero,
            corrected=zero > 0,
            radius=jnp.full(count, jnp.asarray(self.radius, float)),
            best_position=points,
            best_value=values,
            closing=zero > 0,
            closed=jnp.zeros(count, dtype=int),
            active=zero == 0,
        )
        return SequentialState(searches, replace(no_progress(points[0]), best_value=values[0]))

    def step(self, problem: ConstrainedProblem, state: SequentialState) -> SequentialState:
        """One trial of every active start."""
        old, progress = state.searches, state.progress
        lower, width = _scale(problem)
        shape = jax.eval_shape(problem.evaluation, jnp.zeros_like(lower), jnp.ones(()))
        is_equality = jnp.arange(old.price.shape[1]) < shape.equality.shape[0]

        def one(trial: Vector) -> Local:
            def numbers(u: Vector):
                found = problem.evaluation(lower + width * u, jnp.ones(()))
                rows = jnp.concatenate([found.equality, found.inequality + self.inside])
                kept = jnp.all(jnp.abs(found.equality) <= found.tolerance) & jnp.all(found.inequality <= 0)
                vector = jnp.concatenate([found.smooth[None], rows])
                return vector, (vector, merit(found), kept)

            jacobian, (vector, value, kept) = jax.jacfwd(numbers, has_aux=True)(trial)
            return Local(vector[0], jacobian[0], vector[1:], jacobian[1:], value, kept)

        trial = jnp.clip(old.point + old.step, 0.0, 1.0)
        found = evaluate(one, trial)
        ending = progress.iteration >= self.steps
        moved = jax.vmap(lambda o, u, f: _advance(o, u, f, is_equality, ending))(old, trial, found)
        improved = old.active & (found.merit < old.best_value)
        searches = replace(
            select(old.active, moved, old),
            best_position=jnp.where(improved[:, None], lower + width * trial, old.best_position),
            best_value=jnp.where(improved, found.merit, old.best_value),
        )
        progress = after_trials(
            progress, searches.best_position, searches.best_value, old.active, searches.active
        )
        return SequentialState(searches, progress)

    def population(self, state: SequentialState) -> Population:
        """The best point of each start by its merit, and its merit."""
        return Population(state.searches.best_position, state.searches.best_value)


def _scale(problem: ConstrainedProblem) -> tuple[Vector, Vector]:
    lower, upper = (jnp.asarray(bound, dtype=float) for bound in problem.bounds())
    return lower, upper - lower


def _missed(rows: Vector, is_equality: Array) -> Vector:
    """By how much each row is missed."""
    return jnp.where(is_equality, jnp.abs(rows), jnp.maximum(rows, 0.0))


def _advance(old: Searches, trial: Vector, found: Local, is_equality: Array, ending: Scalar) -> Searches:
    """One start after its trial: the point it goes on from, and the next trial."""
    finite = jnp.all(jnp.isfinite(found.rows)) & jnp.all(jnp.isfinite(found.jacobian))
    finite &= jnp.isfinite(found.value) & jnp.all(jnp.isfinite(found.gradient))
    first = ~jnp.isfinite(old.local.value)
    looked_at = jnp.where(old.closing, 0.0, 1.0)

    def total(local: Local) -> Scalar:
        return looked_at * local.value + old.price @ _missed(local.rows, is_equality)

    gained = jnp.where(first, 0.0, total(old.local) - total(found))
    ratio = gained / jnp.maximum(old.promise, 1e-300)
    accepted = finite & (first | (ratio > _ACCEPT))
    local = jax.tree.map(lambda new, known: jnp.where(accepted, new, known), found, old.local)
    point = jnp.where(accepted, trial, old.point)
    hessian = jnp.where(
        accepted & ~first & ~old.closing, _curved(old, trial - old.point, found, is_equality), old.hessian
    )
    # A first failure may be the curvature of the constraints alone: the same step again, corrected.
    again = finite & ~accepted & ~old.corrected
    length = jnp.max(jnp.abs(old.step))
    radius = jnp.where(accepted & (ratio > _GOOD), jnp.maximum(old.radius, 2 * length), old.radius)
    radius = jnp.where(accepted & (ratio < 0.25), 0.5 * length, radius)
    radius = jnp.where(accepted | again, radius, 0.3 * length)
    radius = jnp.clip(jnp.where(first, old.radius, radius), 0.0, _LARGEST_RADIUS)
    dull = (old.promise <= _PROMISE * (1 + jnp.abs(old.local.value))) | (radius < _LEAST_RADIUS)
    closing = old.closing | (~first & dull) | ending
    begins = closing & ~old.closing
    radius = jnp.where(begins, jnp.maximum(radius, _CLOSING_RADIUS), radius)
    closed = old.closed + old.closing
    again &= ~begins
    offset = jnp.where(again, found.rows - old.local.jacobian @ old.step, local.rows)
    step, multiplier, price, promise = _modelled(
        local, offset, point, radius, hessian, old.price, is_equality, closing, begins
    )
    stuck = closing & old.closing & (local.kept | (closed >= _CLOSING_STEPS) | (radius < _LEAST_RADIUS))
    return replace(
        old,
        point=point,
        local=local,
        hessian=hessian,
        multiplier=multiplier,
        price=price,
        step=step,
        # A corrected step is judged by what the plain one promised.
        promise=jnp.where(again, old.promise, promise),
        corrected=again,
        radius=radius,
        closing=closing,
        closed=closed,
        active=(finite | ~first) & ~stuck & ~(begins & local.kept),
    )


def _modelled(
    local: Local,
    offset: Vector,
    point: Vector,
    radius: Scalar,
    hessian: Array,
    price: Vector,
    is_equality: Array,
    closing: Scalar,
    begins: Scalar,
):
    """The next step (d,), multipliers and prices (r,), and what the model promises of the step."""
    gradient = jnp.where(closing, 0.0, local.gradient)
    size = jnp.max(jnp.abs(local.gradient)) + 1e-12
    curvature = jnp.where(closing, size * jnp.eye(point.size), hessian)
    lower, upper = jnp.maximum(-radius, -point), jnp.minimum(radius, 1 - point)
    stiff = jnp.full(price.shape, _STIFF * size)
    found = quadratic_step(curvature, gradient, local.jacobian, offset, is_equality, lower, upper, stiff)
    step = jnp.clip(point + found.step, 0.0, 1.0) - point
    needed = 1.2 * jnp.abs(found.multiplier) + 1e-2 * size
    # Powell's rule: prices follow the multipliers down by and by, and up at once.
    price = jnp.where(begins, needed, jnp.maximum(needed, 0.2 * price + 0.8 * needed))
    linear = local.rows + local.jacobian @ step
    now, then = (price @ _missed(rows, is_equality) for rows in (local.rows, linear))
    bent = jnp.where(closing, 0.0, 0.5 * step @ curvature @ step)
    return step, found.multiplier, price, now - then - gradient @ step - bent


def _curved(old: Searches, step: Vector, found: Local, is_equality: Array) -> Array:
    """The Hessian after a step: damped BFGS of the Lagrangian's gradient."""

    def slope(local: Local) -> Vector:
        return local.gradient + local.jacobian.T @ old.multiplier

    change = slope(found) - slope(old.local)
    pushed = old.hessian @ step
    curved, along = step @ pushed, step @ change
    share = jnp.where(along >= 0.2 * curved, 1.0, 0.8 * curved / jnp.maximum(curved - along, 1e-300))
    change = share * change + (1 - share) * pushed
    along = step @ change
    hessian = old.hessian - jnp.outer(pushed, pushed) / curved + jnp.outer(change, change) / along
    sound = (curved > 1e-16) & (along > 1e-16) & jnp.all(jnp.isfinite(hessian))
    return jnp.where(sound, hessian, old.hessian)
