"""Gradient descent from several starts at once with optax, inside a box.

Every step evaluates the smooth objective and its gradient once at one trial point of each start. The line
search is that of Lewis and Overton (2013): a trial that does not decrease the objective enough bounds the step
from above, one that still descends steeply bounds it from below, any other is accepted and asks optax for the
next direction. So the batch never waits for the longest line search, the compiled program holds the gradient
once, and the count of evaluations is exact. Points are judged by the true objective; a start is never made
worse, and one without a finite value and gradient is drawn again, uniform in the box.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TypeVar

import jax
import jax.numpy as jnp
import optax

from jffsr.optimizers.box import from_box, to_box
from jffsr.optimizers.hyperparameters import number
from jffsr.optimizers.interface import (
    OptimizationProblem,
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

T = TypeVar("T")

LBFGS = "lbfgs"
ADAM = "adam"

_ARMIJO = 1e-4
_CURVATURE = 0.9
# A decrease below rounding cannot be told from none.
_ROUNDING = 1e-13
_SHORTEST_STEP = 1e-10


@register_dataclass
@dataclass(frozen=True)
class Descent:
    """One start: point, smooth value and gradient accepted last, the search direction, and the step length
    on trial between those known to be too short and too long.

    trial and the same point `inside` the box are evaluated next. They are kept here, and not computed where
    they are needed, so that the point reported is the point evaluated to the last bit.
    """

    point: Array
    trial: Array
    inside: Array
    smooth: Array
    gradient: Array
    direction: Array
    length: Array
    too_short: Array
    too_long: Array
    memory: optax.OptState
    stalled: Array
    active: Array
    best_position: Array
    best_value: Array


@register_dataclass
@dataclass(frozen=True)
class GradientState:
    """key; a batch of descents, leading axis (k,), and the progress of all."""

    key: Array
    descent: Descent
    progress: Progress


@register_dataclass
@dataclass(frozen=True)
class GradientDescent:
    """L-BFGS or Adam from `starts` points: the best of a given population, else uniform in the box.

    A start stops when its gradient is shorter than gradient_tolerance, or when value_tolerance times the
    value was not gained in ten accepted steps. looseness is how much rounder than the problem's own the smooth
    objective is. starts, method and memory are static.
    """

    gradient_tolerance: Array | float = number(1e-8, 0)
    value_tolerance: Array | float = number(1e-9, 0)
    learning_rate: Array | float = 0.05
    looseness: Array | float = 1.0
    starts: int = field(default=4, metadata={"static": True})
    method: str = field(default=LBFGS, metadata={"static": True})
    memory: int = field(default=10, metadata={"static": True})

    def transformation(self) -> optax.GradientTransformation:
        if self.method == ADAM:
            return optax.scale_by_adam()
        return optax.scale_by_lbfgs(memory_size=self.memory)

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> GradientState:
        """The starts; nothing is evaluated yet: the first trial is at the start itself, a step of zero.

        A given population keeps its values: the trials stand off the bounds, and may be worse or not finite.
        """
        key, draw = jax.random.split(key)
        if population is None:
            positions = sample_box(draw, problem, self.starts)
            values = jnp.full(self.starts, jnp.inf)
        else:
            values = finite_or_inf(population.values)
            order = jnp.argsort(values)[: self.starts]
            positions, values = population.positions[order], values[order]
        lower, upper = problem.bounds()
        points = jax.vmap(lambda x: from_box(x, lower, upper))(positions)
        descent = Descent(
            point=points,
            memory=jax.vmap(self.transformation().init)(points),
            best_position=positions,
            best_value=values,
            **beginning(problem, points),
        )
        return GradientState(key, descent, replace(no_progress(positions[0]), best_value=values[0]))

    def _evaluate(
        self, problem: OptimizationProblem, trial: Array, inside: Array
    ) -> tuple[Array, Array, Array]:
        """Smooth values, true values and gradients, in unconstrained coordinates, of a batch of points."""

        def objective(x: Vector) -> tuple[Scalar, Scalar]:
            return problem.smooth_and_value(x, self.looseness)

        (smooth, value), in_box = evaluate(jax.value_and_grad(objective, has_aux=True), inside)
        return usable(problem, trial, smooth, value, in_box)

    def step(self, problem: OptimizationProblem, state: GradientState) -> GradientState:
        """One trial of every active start."""
        evaluated = self._evaluate(problem, state.descent.trial, state.descent.inside)
        return self.advanced(problem, state, *evaluated)

    def advanced(
        self, problem: OptimizationProblem, state: GradientState, smooth: Array, value: Array, gradient: Array
    ) -> GradientState:
        """The state after the trials, given the smooth values (k,), true values (k,) and gradients (k, d) there.

        Gradients are by the unconstrained coordinates; what is not finite is +inf, with a gradient of zero.
        """
        descent, progress = state.descent, state.progress
        trial, inside = descent.trial, descent.inside
        lower, upper = problem.bounds()
        advanced = jax.vmap(self._advance)(descent, trial, smooth, gradient)
        improved = descent.active & (value < descent.best_value)
        lost = ~jnp.isfinite(descent.smooth) & ~jnp.isfinite(smooth)
        fresh = sample_box(jax.random.fold_in(state.key, progress.iteration), problem, trial.shape[0])
        again = replace(descent, point=jax.vmap(lambda x: from_box(x, lower, upper))(fresh))
        advanced = select(descent.active, select(lost, again, advanced), descent)
        following = advanced.point + advanced.length[:, None] * advanced.direction
        advanced = replace(
            advanced,
            trial=following,
            inside=_all_to_box(problem, following),
            best_position=jnp.where(improved[:, None], inside, descent.best_position),
            best_value=jnp.where(improved, value, descent.best_value),
        )
        progress = after_trials(
            progress, advanced.best_position, advanced.best_value, descent.active, advanced.active
        )
        return GradientState(state.key, advanced, progress)

    def _advance(self, old: Descent, trial: Vector, smooth: Scalar, gradient: Vector) -> Descent:
        """One start after its trial: the next direction, or another step along the old one."""
        update, memory = self.transformation().update(gradient, old.memory, trial)
        direction = -update
        if self.method == ADAM:
            accepted, too_short, too_long = jnp.isfinite(smooth), old.too_short, old.too_long
            another, first = old.length / 2, jnp.full_like(old.length, self.learning_rate)
        else:
            slope = jnp.vdot(old.gradient, old.direction)
            floor = _ROUNDING * (1 + jnp.abs(old.smooth))
            lower = smooth <= old.smooth + _ARMIJO * old.length * slope + floor
            level = jnp.vdot(gradient, old.direction) >= _CURVATURE * slope
            accepted = lower & level
            too_long = jnp.where(lower, old.too_long, old.length)
            too_short = jnp.where(lower, old.length, old.too_short)
            another = self._another_length(old, too_short, too_long, smooth, slope)
            # Rounding can turn a direction uphill; the slope never does.
            downhill = (jnp.vdot(direction, gradient) < 0) & jnp.all(jnp.isfinite(direction))
            steepest = -gradient / jnp.maximum(jnp.linalg.norm(gradient), 1e-300)
            direction = jnp.where(downhill, direction, steepest)
            first = jnp.ones_like(old.length)
        gained = old.smooth - smooth > self.value_tolerance * (1 + jnp.abs(old.smooth))
        stalled = jnp.where(gained, 0, old.stalled + 1)
        flat = jnp.linalg.norm(gradient) <= self.gradient_tolerance
        spent = (another < _SHORTEST_STEP) | (too_long - too_short < _SHORTEST_STEP * too_long)

        def chosen(new, kept):
            return jax.tree.map(lambda a, b: jnp.where(accepted, a, b), new, kept)

        return Descent(
            point=chosen(trial, old.point),
            smooth=chosen(smooth, old.smooth),
            gradient=chosen(gradient, old.gradient),
            direction=chosen(direction, old.direction),
            length=chosen(first, another),
            too_short=chosen(jnp.zeros_like(too_short), too_short),
            too_long=chosen(jnp.full_like(too_long, jnp.inf), too_long),
            trial=old.trial,
            inside=old.inside,
            memory=chosen(memory, old.memory),
            stalled=chosen(stalled, old.stalled),
            active=jnp.where(accepted, ~flat & (stalled < 10), ~spent),
            best_position=old.best_position,
            best_value=old.best_value,
        )

    def _another_length(self, old: Descent, too_short, too_long, smooth: Scalar, slope: Scalar) -> Scalar:
        """The next step to try: twice as long while nothing bounds it, else between the two bounds."""
        # From a step of zero, the minimum of the parabola through both values and the slope; else halfway.
        bend = smooth - old.smooth - old.length * slope
        parabola = jnp.where(jnp.isfinite(bend) & (bend > 0), -0.5 * old.length**2 * slope / bend, 0.0)
        between = jnp.where(
            too_short > 0, (too_short + too_long) / 2, jnp.clip(parabola, 0.1 * too_long, 0.5 * too_long)
        )
        return jnp.where(jnp.isfinite(too_long), between, 2 * old.length)

    def population(self, state: GradientState) -> Population:
        """The best point of each start."""
        return Population(state.descent.best_position, state.descent.best_value)


def beginning(problem: OptimizationProblem, points: Array) -> dict[str, Array]:
    """The fields of descents that begin at the points (k, d): the first trial is there, a step of zero."""
    count = points.shape[0]
    return {
        "trial": points,
        "inside": _all_to_box(problem, points),
        "smooth": jnp.full(count, jnp.inf),
        "gradient": jnp.zeros_like(points),
        "direction": jnp.zeros_like(points),
        "length": jnp.ones(count),
        "too_short": jnp.zeros(count),
        "too_long": jnp.full(count, jnp.inf),
        "stalled": jnp.zeros(count, dtype=int),
        "active": jnp.ones(count, dtype=bool),
    }


def usable(
    problem: OptimizationProblem, trial: Array, smooth: Array, value: Array, in_box: Array
) -> tuple[Array, Array, Array]:
    """Smooth values (k,), true values (k,) and gradients (k, d) as a descent takes them.

    trial (k, d) in unconstrained coordinates, in_box (k, d) the gradients by the candidates; what is not finite
    becomes +inf, with a gradient of zero.
    """
    _, pull_back = jax.vjp(partial(_all_to_box, problem), trial)
    (gradient,) = pull_back(in_box)
    finite = jnp.isfinite(smooth) & jnp.all(jnp.isfinite(gradient), axis=1)
    return (
        jnp.where(finite, smooth, jnp.inf),
        finite_or_inf(value),
        jnp.where(finite[:, None], gradient, 0.0),
    )


def select(which: Array, yes: T, no: T) -> T:
    """For each start (k,) the one or the other of two trees of arrays with leading axes (k,)."""
    return jax.tree.map(lambda a, b: jnp.where(which.reshape((-1,) + (1,) * (a.ndim - 1)), a, b), yes, no)


def _all_to_box(problem: OptimizationProblem, points: Array) -> Array:
    lower, upper = problem.bounds()
    return jax.vmap(lambda z: to_box(z, lower, upper))(points)
