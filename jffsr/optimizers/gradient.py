"""Gradient descent from several starts at once with optax, inside a box.

Every step evaluates the smooth objective and its gradient once at one trial point of each start: a trial
that does not decrease it enough (Armijo) shortens the step, one that does asks optax for the next direction.
So the batch never waits for the longest line search, the compiled program holds the gradient once, and the
count of evaluations is exact. Points are judged by the true objective; a start is never made worse.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import optax

from jffsr.optimizers.box import from_box, to_box
from jffsr.optimizers.interface import (
    OptimizationProblem,
    Population,
    Progress,
    better_of,
    finite_or_inf,
    sample_box,
)
from jffsr.types import Array, Scalar, Vector

LBFGS = "lbfgs"
ADAM = "adam"

_ARMIJO = 1e-4
# A decrease below rounding cannot be told from none.
_ROUNDING = 1e-13
_SHORTEST_STEP = 1e-9


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Descent:
    """One start: point, smooth value and gradient accepted last, the search direction and step length."""

    point: Array
    smooth: Array
    gradient: Array
    direction: Array
    length: Array
    memory: optax.OptState
    stalled: Array
    active: Array
    best_position: Array
    best_value: Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class GradientState:
    """A batch of descents, leading axis (k,), and the progress of all."""

    descent: Descent
    progress: Progress


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class GradientDescent:
    """L-BFGS or Adam from `starts` points: the best of a given population, else uniform in the box.

    A start stops when its gradient is shorter than gradient_tolerance, or when value_tolerance times the
    value was not gained in ten accepted steps. starts, method and memory are static.
    """

    gradient_tolerance: Array | float = 1e-8
    value_tolerance: Array | float = 1e-9
    learning_rate: Array | float = 0.05
    starts: int = field(default=4, metadata={"static": True})
    method: str = field(default=LBFGS, metadata={"static": True})
    memory: int = field(default=10, metadata={"static": True})

    def _transformation(self) -> optax.GradientTransformation:
        if self.method == ADAM:
            return optax.scale_by_adam()
        return optax.scale_by_lbfgs(memory_size=self.memory)

    def init(
        self, key: Array, problem: OptimizationProblem, population: Population | None = None
    ) -> GradientState:
        """The starts and their gradients; one evaluation of each start."""
        if population is None:
            positions = sample_box(key, problem, self.starts)
        else:
            order = jnp.argsort(finite_or_inf(population.values))[: self.starts]
            positions = population.positions[order]
        lower, upper = problem.bounds()
        points = jax.vmap(lambda x: from_box(x, lower, upper))(positions)
        smooth, value, gradient = self._evaluate(problem, points)
        direction, memory = jax.vmap(self._first_direction)(gradient, points)
        count = points.shape[0]
        inside = jax.vmap(lambda z: to_box(z, lower, upper))(points)
        descent = Descent(
            point=points,
            smooth=smooth,
            gradient=gradient,
            direction=direction,
            length=jnp.ones(count) * (self.learning_rate if self.method == ADAM else 1.0),
            memory=memory,
            stalled=jnp.zeros(count, dtype=int),
            active=jnp.isfinite(smooth),
            best_position=inside,
            best_value=value,
        )
        best = jnp.argmin(value)
        best_position, best_value = inside[best], value[best]
        if population is not None:
            best_position, best_value = better_of(
                best_position, best_value, population.positions, finite_or_inf(population.values)
            )
        progress = Progress(
            best_position=best_position,
            best_value=best_value,
            iteration=jnp.array(0),
            evaluations=jnp.array(0),
            gradient_evaluations=jnp.array(count),
            converged=~jnp.any(descent.active),
        )
        return GradientState(descent, progress)

    def _evaluate(self, problem: OptimizationProblem, points: Array) -> tuple[Array, Array, Array]:
        """Smooth values, true values and gradients of a batch of unconstrained points."""
        lower, upper = problem.bounds()

        def objective(z: Vector) -> tuple[Scalar, Scalar]:
            return problem.smooth_and_value(to_box(z, lower, upper))

        (smooth, value), gradient = jax.vmap(jax.value_and_grad(objective, has_aux=True))(points)
        usable = jnp.isfinite(smooth) & jnp.all(jnp.isfinite(gradient), axis=1)
        return (
            jnp.where(usable, smooth, jnp.inf),
            finite_or_inf(value),
            jnp.where(usable[:, None], gradient, 0.0),
        )

    def _first_direction(self, gradient: Vector, point: Vector):
        transformation = self._transformation()
        update, memory = transformation.update(gradient, transformation.init(point), point)
        return -update, memory

    def step(self, problem: OptimizationProblem, state: GradientState) -> GradientState:
        """One trial of every active start."""
        descent, progress = state.descent, state.progress
        trial = descent.point + descent.length[:, None] * descent.direction
        smooth, value, gradient = self._evaluate(problem, trial)
        lower, upper = problem.bounds()
        inside = jax.vmap(lambda z: to_box(z, lower, upper))(trial)
        advanced = jax.vmap(self._advance)(descent, trial, smooth, gradient)
        improved = descent.active & (value < descent.best_value)
        advanced = jax.tree.map(
            lambda new, old: jnp.where(
                descent.active.reshape((-1,) + (1,) * (new.ndim - 1)), new, old
            ),
            advanced,
            descent,
        )
        advanced = replace(
            advanced,
            best_position=jnp.where(improved[:, None], inside, descent.best_position),
            best_value=jnp.where(improved, value, descent.best_value),
        )
        best_position, best_value = better_of(
            progress.best_position, progress.best_value, advanced.best_position, advanced.best_value
        )
        progress = Progress(
            best_position=best_position,
            best_value=best_value,
            iteration=progress.iteration + 1,
            evaluations=progress.evaluations,
            gradient_evaluations=progress.gradient_evaluations + jnp.sum(descent.active),
            converged=~jnp.any(advanced.active),
        )
        return GradientState(advanced, progress)

    def _advance(self, old: Descent, trial: Vector, smooth: Scalar, gradient: Vector) -> Descent:
        """One start after its trial: the next direction, or a shorter step along the old one."""
        if self.method == ADAM:
            accepted = jnp.isfinite(smooth)
        else:
            slope = jnp.vdot(old.gradient, old.direction)
            floor = _ROUNDING * (1 + jnp.abs(old.smooth))
            accepted = smooth <= old.smooth + _ARMIJO * old.length * slope + floor
        update, memory = self._transformation().update(gradient, old.memory, trial)
        direction = -update
        if self.method == LBFGS:
            # Curvature pairs of negative sign can turn the direction uphill: fall back to the slope.
            downhill = jnp.vdot(direction, gradient) < 0
            direction = jnp.where(downhill & jnp.all(jnp.isfinite(direction)), direction, -gradient)
        gained = old.smooth - smooth > self.value_tolerance * (1 + jnp.abs(old.smooth))
        stalled = jnp.where(gained, 0, old.stalled + 1)
        flat = jnp.linalg.norm(gradient) <= self.gradient_tolerance
        if self.method == ADAM:
            shorter, full = old.length, old.length
        else:
            # The minimum of the parabola through both values and the slope, kept within [0.1, 0.5].
            bend = smooth - old.smooth - old.length * slope
            ratio = jnp.where(jnp.isfinite(bend) & (bend > 0), -0.5 * old.length * slope / bend, 0.1)
            shorter, full = old.length * jnp.clip(ratio, 0.1, 0.5), jnp.ones_like(old.length)

        def chosen(new, kept):
            return jax.tree.map(lambda a, b: jnp.where(accepted, a, b), new, kept)

        return Descent(
            point=chosen(trial, old.point),
            smooth=chosen(smooth, old.smooth),
            gradient=chosen(gradient, old.gradient),
            direction=chosen(direction, old.direction),
            length=chosen(full, shorter),
            memory=chosen(memory, old.memory),
            stalled=chosen(stalled, old.stalled),
            active=jnp.where(accepted, ~flat & (stalled < 10), shorter > _SHORTEST_STEP),
            best_position=old.best_position,
            best_value=old.best_value,
        )

    def population(self, state: GradientState) -> Population:
        """The best point of each start."""
        return Population(state.descent.best_position, state.descent.best_value)

