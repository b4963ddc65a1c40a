"""Augmented Lagrangian: equality and inequality constraints for gradient descent, one inner step at a time.

Nocedal and Wright, "Numerical Optimization", 2nd edition, section 17.3: descend

    f + sum(y c + r/2 c^2) + sum(max(0, z + r g)^2 - z^2) / (2 r)

in x, then move the multipliers y of c = 0 to y + r c and z of g <= 0 to max(0, z + r g), and where the
constraints were not missed much less than the time before, raise the penalty r (Andreani, Birgin, Martinez and
Schuverdt, SIAM J. Optim. 18, 2007). Every start has its own multipliers, penalty and rounds. A round begins with a
trial where the last one ended; that one evaluation moves the multipliers and gives the value and gradient under
the new ones, so that a step is one gradient of every active start, as in the descent itself.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import jax
import jax.numpy as jnp

from jffsr.optimizers.constraints import ConstrainedProblem, Evaluation, merit
from jffsr.optimizers.driver import Phase, Stop
from jffsr.optimizers.gradient import LBFGS, GradientDescent, GradientState, beginning, select, usable
from jffsr.optimizers.interface import Population, Progress
from jffsr.parallel.mapping import evaluate
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class Multipliers:
    """Of one start: equality (e,), inequality (i,), penalty (), and how far the constraints were missed at the
    last update, +inf before the first."""

    equality: Array
    inequality: Array
    penalty: Array
    miss: Array


@register_dataclass
@dataclass(frozen=True)
class AugmentedState:
    """The descents of all starts (k,), their multipliers, and where each stands in its round.

    begins: the trial to come is the first of a round; settled: the last round did not end for want of steps;
    arrived: it ended in a minimum at the last accuracy; spent: steps of the round; accuracy: the gradient, relative
    to the value, at which it ends; looseness of the objective.
    """

    inner: GradientState
    multipliers: Multipliers
    begins: Array
    settled: Array
    arrived: Array
    spent: Array
    accuracy: Array
    looseness: Array

    @property
    def progress(self) -> Progress:
        """For the driver; values are merits."""
        return self.inner.progress


@register_dataclass
@dataclass(frozen=True)
class AugmentedLagrangian:
    """Constrained descent from the starts of `descent`, whose own settings hold within a round.

    A start stops where a round ended in a minimum and no constraint is missed by more than `tolerance`, or where
    its penalty has passed penalty_limit, which means that no point near keeps the constraints. Inequalities are
    kept with `margin` to spare, so that what is found keeps them to the last bit. The penalty begins where it
    balances the value, with `penalty` times the value at most, and grows by `growth`; `share`, the most steps of a
    round; each round looseness falls to a tenth, from the descent's own to 1, and accuracy from first_accuracy to the
    descent's gradient_tolerance.
    """

    descent: GradientDescent = field(default_factory=GradientDescent)
    tolerance: Array | float = 1e-10
    margin: Array | float = 1e-9
    penalty: Array | float = 1.0
    growth: Array | float = 10.0
    penalty_limit: Array | float = 1e12
    share: Array | float = 100.0
    first_accuracy: Array | float = 0.1

    @property
    def starts(self) -> int:
        """How many points are descended from."""
        return self.descent.starts

    def init(self, key: Array, problem: ConstrainedProblem, population: Population | None = None):
        """The descent's own starts, with multipliers of zero; nothing is evaluated yet."""
        inner = self.descent.init(key, problem, population)
        points = inner.descent.inside
        count = points.shape[0]
        shape = jax.eval_shape(problem.evaluation, points[0], jnp.ones(()))
        multipliers = Multipliers(
            equality=jnp.zeros((count, *shape.equality.shape)),
            inequality=jnp.zeros((count, *shape.inequality.shape)),
            penalty=jnp.ones(count),
            miss=jnp.full(count, jnp.inf),
        )
        return AugmentedState(
            inner,
            multipliers,
            begins=jnp.ones(count, dtype=bool),
            settled=jnp.zeros(count, dtype=bool),
            arrived=jnp.zeros(count, dtype=bool),
            spent=jnp.zeros(count, dtype=int),
            accuracy=jnp.full(count, jnp.asarray(self.first_accuracy, float)),
            looseness=jnp.full(count, jnp.asarray(self.descent.looseness, float)),
        )

    def step(self, problem: ConstrainedProblem, state: AugmentedState) -> AugmentedState:
        """One trial of every active start, and a new round for those whose round is over."""
        before = state.inner.descent
        smooth, value, gradient, multipliers = self._evaluate(problem, state)
        same = (multipliers.penalty == state.multipliers.penalty) & ~jnp.isinf(state.multipliers.miss)
        memory = jax.vmap(partial(self._memory, inner=self.descent.transformation()))(
            before.memory, before.point, gradient, state.begins, same
        )
        inner = replace(state.inner, descent=replace(before, memory=memory))
        inner = self.descent.advanced(problem, inner, smooth, value, gradient)
        descent, active = inner.descent, before.active
        begun = state.begins & jnp.isfinite(smooth)
        solved = state.arrived & (state.looseness <= 1) & (multipliers.miss <= self.tolerance)
        ended = active & begun & (solved | (multipliers.penalty > self.penalty_limit))
        spent = state.spent + active
        size = jnp.maximum(1.0, jnp.abs(descent.smooth))
        small = jnp.linalg.norm(descent.gradient, axis=1) <= state.accuracy * size
        over = active & ~ended & (~state.begins | begun) & (~descent.active | small | (spent >= self.share))
        final = state.accuracy <= self.descent.gradient_tolerance
        arrived = jnp.where(over, ~descent.active | (small & final), state.arrived)
        settled = jnp.where(over, ~descent.active | small, state.settled)
        descent = select(over, replace(descent, **beginning(problem, descent.point)), descent)
        descent = replace(descent, active=descent.active & ~ended)
        progress = replace(inner.progress, converged=~jnp.any(descent.active))
        return AugmentedState(
            GradientState(inner.key, descent, progress),
            select(active, multipliers, state.multipliers),
            begins=jnp.where(active, over | (state.begins & ~begun), state.begins),
            settled=settled,
            arrived=arrived,
            spent=jnp.where(over, 0, spent),
            accuracy=jnp.where(
                over, jnp.maximum(0.1 * state.accuracy, self.descent.gradient_tolerance), state.accuracy
            ),
            looseness=jnp.where(over, jnp.maximum(0.1 * state.looseness, 1.0), state.looseness),
        )

    def _evaluate(self, problem: ConstrainedProblem, state: AugmentedState):
        """Smooth values (k,), merits (k,), gradients (k, d) and multipliers of all trials."""
        descent = state.inner.descent

        def one(item: tuple[Vector, Multipliers, Scalar, Scalar, Scalar]):
            inside, multipliers, begins, settled, looseness = item

            def objective(x: Vector):
                found = problem.evaluation(x, looseness)
                used = self._updated(multipliers, found, begins, settled)
                return self._augmented(used, found), (merit(found), used)

            (smooth, rest), gradient = jax.value_and_grad(objective, has_aux=True)(inside)
            return smooth, *rest, gradient

        smooth, value, multipliers, in_box = evaluate(
            one, (descent.inside, state.multipliers, state.begins, state.settled, state.looseness)
        )
        return *usable(problem, descent.trial, smooth, value, in_box), multipliers

    def _updated(self, old: Multipliers, found: Evaluation, begins: Scalar, settled: Scalar) -> Multipliers:
        """The multipliers of a round, from where the last one ended; its first sets the penalty alone."""
        value, c, g = jax.lax.stop_gradient((found.smooth, found.equality, found.inequality + self.margin))
        first = jnp.isinf(old.miss)
        # How far complementarity is missed, too: an inequality that is kept must have no multiplier.
        missed = jnp.concatenate([jnp.abs(c), jnp.abs(jnp.maximum(g, -old.inequality / old.penalty))])
        miss = jnp.max(missed, initial=0.0)
        slow = settled & (miss > 0.25 * old.miss) & (miss > self.tolerance)
        # Balances the objective and the penalty at the start (Birgin and Martinez, 2014, section 12.4).
        squares = jnp.sum(c**2) + jnp.sum(jnp.maximum(g, 0.0) ** 2)
        size = jnp.maximum(1.0, jnp.abs(value))
        balance = jnp.clip(2 * size / jnp.maximum(squares, 1e-12), 1e-6 * size, self.penalty * size)
        raised = jnp.where(slow, self.growth * old.penalty, old.penalty)
        new = Multipliers(
            equality=jnp.where(first, old.equality, old.equality + old.penalty * c),
            inequality=jnp.where(first, old.inequality, jnp.maximum(0.0, old.inequality + old.penalty * g)),
            penalty=jnp.where(first, balance, raised),
            miss=miss,
        )
        known = begins & jnp.isfinite(miss) & jnp.isfinite(value)
        return jax.tree.map(lambda a, b: jnp.where(known, a, b), new, old)

    def _augmented(self, m: Multipliers, found: Evaluation) -> Scalar:
        c, g = found.equality, found.inequality + self.margin
        shifted = jnp.maximum(0.0, m.inequality + m.penalty * g)
        return (
            found.smooth
            + jnp.sum(m.equality * c + 0.5 * m.penalty * c**2)
            + jnp.sum(shifted**2 - m.inequality**2) / (2 * m.penalty)
        )

    def _memory(self, memory, point: Vector, gradient: Vector, begins: Scalar, same: Scalar, inner):
        """The descent's memory before a trial: at the first of a round it holds on where the penalty is the same.

        New multipliers move the gradient and hardly the curvature, which is what L-BFGS remembers. So that it does
        not take the move for curvature, it is set back by one pair of steps, which the trial then adds again.
        """
        fresh = inner.init(point)
        if self.descent.method != LBFGS:
            return jax.tree.map(lambda a, b: jnp.where(begins, a, b), fresh, memory)
        last = (memory.count - 2) % self.descent.memory
        step, change = memory.diff_params_memory[last], memory.diff_updates_memory[last]
        back = memory._replace(count=memory.count - 1, params=point - step, updates=gradient - change)
        # What is left of a pair that is short next to the numbers it is taken from.
        curved = jnp.vdot(point - back.params, gradient - back.updates) > 0
        held = same & curved & (memory.count >= 2)
        first = jax.tree.map(lambda a, b: jnp.where(held, a, b), back, fresh)
        return jax.tree.map(lambda a, b: jnp.where(begins, a, b), first, memory)

    def population(self, state: AugmentedState) -> Population:
        """The best point of each start, by merit, and its merit."""
        return self.descent.population(state.inner)


def constrained_phases(phases: list[Phase]) -> list[Phase]:
    """The phases of an optimizer for a constrained problem: descents in a row become one augmented Lagrangian.

    It has the steps of all of them, and begins with the looseness of the first. The other phases stay as they
    are: the merit is all that they need.
    """
    result: list[Phase] = []
    for phase in phases:
        if not isinstance(phase.optimizer, GradientDescent):
            result.append(phase)
        elif result and isinstance(result[-1].optimizer, AugmentedLagrangian):
            result[-1] = replace(result[-1], stop=_sum(result[-1].stop, phase.stop))
        else:
            result.append(Phase("constrained", AugmentedLagrangian(phase.optimizer), phase.stop))
    return result


def _sum(a: Stop, b: Stop) -> Stop:
    return Stop(
        iterations=a.iterations + b.iterations,
        evaluations=a.evaluations + b.evaluations,
        gradient_evaluations=a.gradient_evaluations + b.gradient_evaluations,
        target=a.target,
    )
