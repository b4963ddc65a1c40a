"""Constraints first: the least-squares way back to where every constraint is kept, from several starts at once.

Levenberg (1944) and Marquardt (1963) on the sum of the squares of all equalities and of the inequalities above zero,
inside a box: a number that the step would carry out of the box stays at its bound. Each trial costs one forward
derivative of the constraints; near a point that keeps them the steps converge quadratically, so that what takes
descents hundreds of gradients takes some ten of these. The objective is not looked at.
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
from jffsr.parallel.mapping import evaluate
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

_LEAST_DAMPING, _MOST_DAMPING = 1e-12, 1e12
_PATIENCE = 10


@register_dataclass
@dataclass(frozen=True)
class Trials:
    """A batch of starts (k, ...): the point accepted last, its residual (r,) and Jacobian (r, d), the trial that is
    evaluated next, the damping; the best points so far and their merits; whether the point accepted keeps every
    constraint; steps without gain; whether a start is still under way."""

    point: Array
    residual: Array
    jacobian: Array
    trial: Array
    damping: Array
    best_position: Array
    best_value: Array
    kept: Array
    stalled: Array
    active: Array


@register_dataclass
@dataclass(frozen=True)
class RestorationState:
    """key; the trials, and the progress of all."""

    key: Array
    trials: Trials
    progress: Progress


@register_dataclass
@dataclass(frozen=True)
class Restoration:
    """Levenberg-Marquardt steps to where the constraints are kept, from `starts` (static) points.

    The starts are the best of a given population, else uniform in the box; one that has no finite residual is drawn
    again. inside: how far below zero inequalities are driven; damping: that of the first step, relative to the mean
    square of the Jacobian's columns. A start ends where every constraint is kept and another step gains little, or
    where ten steps in a row have gained next to nothing.
    """

    inside: Array | float = number(1e-4, 0)
    damping: Array | float = number(1e-3, 0)
    starts: int = field(default=4, metadata={"static": True})

    def init(
        self, key: Array, problem: ConstrainedProblem, population: Population | None = None
    ) -> RestorationState:
        """The starts; nothing is evaluated yet: the first trial is the start itself."""
        key, draw = jax.random.split(key)
        if population is None:
            points, values = sample_box(draw, problem, self.starts), jnp.full(self.starts, jnp.inf)
        else:
            values = finite_or_inf(population.values)
            order = jnp.argsort(values)[: self.starts]
            points, values = jnp.asarray(population.positions)[order], values[order]
        count = points.shape[0]
        shape = jax.eval_shape(problem.evaluation, points[0], jnp.ones(()))
        size = shape.equality.shape[0] + shape.inequality.shape[0]
        trials = Trials(
            point=points,
            residual=jnp.full((count, size), jnp.inf),
            jacobian=jnp.zeros((count, size, points.shape[1])),
            trial=points,
            damping=jnp.full(count, jnp.asarray(self.damping, float)),
            best_position=points,
            best_value=values,
            kept=jnp.zeros(count, dtype=bool),
            stalled=jnp.zeros(count, dtype=int),
            active=jnp.ones(count, dtype=bool),
        )
        return RestorationState(key, trials, replace(no_progress(points[0]), best_value=values[0]))

    def step(self, problem: ConstrainedProblem, state: RestorationState) -> RestorationState:
        """One trial of every active start."""
        old, progress = state.trials, state.progress

        def one(trial: Vector):
            def residual(x: Vector):
                found = problem.evaluation(x, jnp.ones(()))
                rest = jnp.maximum(found.inequality + self.inside, 0.0)
                vector = jnp.concatenate([found.equality, rest])
                kept = jnp.all(jnp.abs(found.equality) <= found.tolerance) & jnp.all(found.inequality <= 0)
                return vector, (vector, merit(found), kept)

            jacobian, (vector, value, kept) = jax.jacfwd(residual, has_aux=True)(trial)
            return vector, jacobian, value, kept

        residual, jacobian, value, kept = evaluate(one, old.trial)
        fresh = sample_box(jax.random.fold_in(state.key, progress.iteration), problem, old.trial.shape[0])
        lower, upper = problem.bounds()
        moved = jax.vmap(lambda o, r, j, k, f: _advance(o, r, j, k, f, lower, upper))(
            old, residual, jacobian, kept, fresh
        )
        improved = old.active & (value < old.best_value)
        trials = replace(
            select(old.active, moved, old),
            best_position=jnp.where(improved[:, None], old.trial, old.best_position),
            best_value=jnp.where(improved, value, old.best_value),
        )
        progress = after_trials(progress, trials.best_position, trials.best_value, old.active, trials.active)
        return RestorationState(state.key, trials, progress)

    def population(self, state: RestorationState) -> Population:
        """The best point of each start by its merit, and its merit."""
        return Population(state.trials.best_position, state.trials.best_value)


def _advance(
    old: Trials,
    residual: Vector,
    jacobian: Array,
    kept: Scalar,
    fresh: Vector,
    lower: Vector,
    upper: Vector,
) -> Trials:
    """One start after its trial: the next one, from there where it helped, else a shorter one from the old point."""
    finite = jnp.all(jnp.isfinite(residual)) & jnp.all(jnp.isfinite(jacobian))
    # The first trial is accepted if it is a number at all; where it is none, another start is drawn.
    before, after = jnp.sum(old.residual**2), jnp.sum(jnp.where(finite, residual, jnp.inf) ** 2)
    first = ~jnp.isfinite(before)
    accepted = finite & (after < before)
    point = jnp.where(accepted, old.trial, old.point)
    vector = jnp.where(accepted, residual, old.residual)
    matrix = jnp.where(accepted, jacobian, old.jacobian)
    eased = jnp.where(accepted & ~first, 0.2 * old.damping, 4 * old.damping)
    damping = jnp.clip(jnp.where(first, old.damping, eased), _LEAST_DAMPING, _MOST_DAMPING)
    known = jnp.isfinite(jnp.sum(vector**2))
    step = damped_step(matrix, jnp.where(known, vector, 0.0), damping, point, lower, upper)
    trial = jnp.where(known, jnp.clip(point + step, lower, upper), fresh)
    kept = jnp.where(accepted, kept, old.kept)
    # Once all is kept, a step or two more bring the equalities to rounding, and then gain no more.
    gained = accepted & (after < 0.05 * before)
    stalled = jnp.where(first | (accepted & (after < 0.98 * before)), 0, old.stalled + 1)
    ended = jnp.where(kept, ~gained | (after == 0), (stalled >= _PATIENCE) | (damping >= _MOST_DAMPING))
    return replace(
        old,
        point=point,
        residual=vector,
        jacobian=matrix,
        trial=trial,
        damping=damping,
        kept=kept,
        stalled=stalled,
        active=~ended,
    )


def damped_step(
    jacobian: Array, residual: Vector, damping: Scalar, point: Vector, lower: Vector, upper: Vector
) -> Vector:
    """The Levenberg-Marquardt step (d,) of |residual + jacobian step|^2 inside the box [lower, upper].

    jacobian (r, d); damping is relative to the mean square of the columns. Numbers at a bound that the gradient
    would push beyond it do not move.
    """
    gradient = jacobian.T @ residual
    held = ((point <= lower) & (gradient > 0)) | ((point >= upper) & (gradient < 0))
    free = jnp.where(held, 0.0, 1.0)
    reduced = jacobian * free
    size = jnp.sum(reduced**2) / jacobian.shape[1]
    matrix = reduced.T @ reduced + jnp.diag(jnp.where(held, 1.0, damping * size + 1e-300))
    factor = jax.scipy.linalg.cho_factor(matrix)
    return -jax.scipy.linalg.cho_solve(factor, free * gradient)
