"""The Pareto set of captures in two indices: what can be had of the one at what price of the other.

First each index alone is made least. Between these ends the second is made less while the first is at most some level
(the epsilon-constraint method: Haimes, Lasdon and Wismer, IEEE Trans. Systems, Man, and Cybernetics 1, 1971), each
level begun from where its neighbours came to, in rounds. All levels run side by side in one compiled program, that of
the ends, too: levels, and which index is made less, are numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np

from jffsr.capture.captures import CaptureSettings
from jffsr.capture.improve import improve_many
from jffsr.capture.plan import FINER, CapturePlan, verified_plans
from jffsr.capture.terms import BaseDisturbance, IndexAtMost, LostManipulability
from jffsr.errors import InputError
from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.smoothing import Smoothing
from jffsr.objectives.terms import Term
from jffsr.optimizers.pareto import not_dominated
from jffsr.optimizers.sequential_quadratic import SequentialQuadratic
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.types import Array, Scalar

ROUNDS = ((1e-3, False), (1e-3, True), (0.03, False), (0.03, True))
"""Of the levels between the ends: how far inside their limits the inequalities are driven, so that what is not verified
is tried again further in, and whether a level begins from its neighbour above, which does not keep it."""

STEPS = 40
"""Trials of each lane in a round."""

INSIDE = (1e-3, 0.03, 0.1)
"""The same of the lanes that seek the ends."""

_ALIKE = 1e-4
"""Members nearer to each other than this, relative to the extent of the set, are one."""

_LOST = "lost_"


@register_dataclass
@dataclass(frozen=True)
class WeightedTerms:
    """A sum of terms with weights (t,) that may be zero, each over its own scale; a term of an index itself."""

    terms: tuple[Term, ...]
    weights: Array
    scale: Array | float = 1.0
    name: str = field(default="weighted", metadata={"static": True})

    @property
    def needs_torque(self) -> bool:
        """Whether one of them reads the joint torques."""
        return any(getattr(term, "needs_torque", False) for term in self.terms)

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published forms."""
        return self._sum([term.value(robot, motion) for term in self.terms])

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The rounded ones."""
        return self._sum([term.smooth(robot, motion, smoothing) for term in self.terms])

    def _sum(self, values: list[Scalar]) -> Scalar:
        scales = [term.scale for term in self.terms]
        return sum(
            w * value / k for w, value, k in zip(jnp.asarray(self.weights), values, scales, strict=True)
        )


@dataclass(frozen=True)
class CaptureFront:
    """Verified captures none of which is better than another in both indices, by the first of them.

    plans (P); values (P, 2) in the indices' own units, a manipulability counted positive, so that more is better;
    names of both as told; chosen: numbers of the plans of least first and second index, under `least_` and the index's
    own name, and of the `balanced` one, the nearest to the ideal point with both indices scaled to [0, 1] by the set.
    """

    plans: tuple[CapturePlan, ...]
    values: np.ndarray
    names: tuple[str, str]
    chosen: dict[str, int]

    def __len__(self) -> int:
        return len(self.plans)


def capture_front(
    plan: CapturePlan,
    indices: Sequence[Term] | None = None,
    *,
    levels: int = 8,
    settings: CaptureSettings | None = None,
    end_effector: str | None = None,
    others: np.ndarray | None = None,
) -> CaptureFront:
    """The Pareto set of two indices about a verified plan, by default the base's disturbance and lost manipulability.

    levels: lanes side by side, two or more; settings tell the steps of the re-run. The set is what descents find from
    this plan and from `others`, free numbers (m, k) of the same problem (`different_captures`), of which those count
    that the re-run confirms. Raises InputError for a plan that is none, and for indices that are not two of different
    names.
    """
    if plan.problem is None or not plan.result.success:
        raise InputError(f"a front needs a verified plan; this one: {plan.result.sentence}")
    if indices is None:
        path = next(c.path for c in plan.problem.constraints if c.name == "grasp_match")
        lost = LostManipulability(path, np.asarray(1.0), end_effector=end_effector)
        indices = (BaseDisturbance(np.asarray(1.0)), lost)
    pair = tuple(indices)
    if len(pair) != 2 or pair[0].name == pair[1].name:
        raise InputError(
            f"a front has two indices of different names; found {', '.join(term.name for term in pair) or 'none'}"
        )
    if levels < 2:
        raise InputError(f"levels is {levels}; 2 or more are expected")
    search = _Search(plan, pair, levels, settings or CaptureSettings(), end_effector)
    if others is not None and len(others):
        search.take_others(np.asarray(others))
    search.find_ends()
    for inside, from_above in ROUNDS:
        search.go_between(inside, from_above)
    return search.front()


class _Search:
    """The pool of verified plans and their values, both to be made small, as it grows."""

    def __init__(
        self,
        plan: CapturePlan,
        pair: tuple[Term, Term],
        lanes: int,
        settings: CaptureSettings,
        end_effector: str | None,
    ):
        self._pair, self._lanes = pair, lanes
        self._settings, self._end_effector = settings, end_effector
        index = CompositeIndex(pair, accuracy=np.asarray(np.inf))
        steps = max(plan.problem.num_steps, FINER * settings.num_steps)
        self._told = replace(plan.problem, objective=index, num_steps=steps)
        self.plans: list[CapturePlan] = []
        self.values = np.zeros((0, 2))
        self._take(np.tile(plan.free, (lanes, 1)), 1)
        if not self.plans:
            raise InputError("the plan given keeps its constraints no longer; plan it anew")

    def take_others(self, free: np.ndarray) -> None:
        """Other plans of the capture, and descents from as many of them as there are lanes, the best first."""
        for start in range(0, len(free), self._lanes):
            some = free[start : start + self._lanes]
            self._take(np.concatenate([some, np.tile(some[:1], (self._lanes - len(some), 1))]), len(some))
        rank = np.argsort(self.values, axis=0)
        lanes = np.arange(self._lanes)
        which = lanes % 2
        chosen = rank[np.minimum(lanes // 2, len(rank) - 1), which]
        start = np.stack([self.plans[number].free for number in chosen])
        far = np.full((self._lanes, 2), np.inf)
        self._lower(start, np.eye(2)[which], far, np.full(self._lanes, INSIDE[1]))

    def find_ends(self) -> None:
        """Each index alone, half of the lanes each, further inside the limits from one lane to the next."""
        lanes = np.arange(self._lanes)
        which = lanes % 2
        inside = np.asarray(INSIDE)[np.minimum(lanes // 2, len(INSIDE) - 1)]
        for _ in range(2):
            best = [int(np.argmin(self.values[:, k])) for k in range(2)]
            start = np.stack([self.plans[best[k]].free for k in which])
            self._lower(start, np.eye(2)[which], np.full((self._lanes, 2), np.inf), inside)

    def go_between(self, inside: float, from_above: bool) -> None:
        """The second index under levels of the first, from the best that is known at each, or the next above it."""
        ends = np.argmin(self.values, axis=0)
        first = self.values[ends, 0]
        levels = first[0] + (first[1] - first[0]) * np.arange(1, self._lanes + 1) / (self._lanes + 1)
        allowed = self.values[None, :, 0] <= levels[:, None] + 1e-12
        start = np.argmin(np.where(allowed, self.values[None, :, 1], np.inf), axis=1)
        if from_above:
            front = not_dominated(self.values)
            above = np.where(
                self.values[None, front, 0] > levels[:, None], self.values[None, front, 0], np.inf
            )
            start = front[np.argmin(above, axis=1)]
        limits = np.column_stack([levels, np.full(self._lanes, np.inf)])
        weights = np.tile([0.0, 1.0], (self._lanes, 1))
        free = np.stack([self.plans[number].free for number in start])
        self._lower(free, weights, limits, np.full(self._lanes, inside))

    def front(self) -> CaptureFront:
        """What is not dominated."""
        kept = not_dominated(self.values)
        kept = kept[np.argsort(self.values[kept, 0])]
        kept = kept[_apart(self.values[kept])]
        values = self.values[kept]
        extent = np.ptp(values, axis=0)
        scaled = (values - values.min(axis=0)) / np.where(extent > 0, extent, 1.0)
        names = [term.name for term in self._pair]
        chosen = {f"least_{name}": int(np.argmin(values[:, k])) for k, name in enumerate(names)}
        chosen["balanced"] = int(np.argmin(np.linalg.norm(scaled, axis=1)))
        lost = np.array([name.startswith(_LOST) for name in names])
        told = tuple(name.removeprefix(_LOST) for name in names)
        return CaptureFront(tuple(self.plans[k] for k in kept), np.where(lost, -values, values), told, chosen)

    def _lower(self, free: np.ndarray, weights: np.ndarray, limits: np.ndarray, inside: np.ndarray) -> None:
        """One round of descents, a lane each; what the re-run confirms joins the pool."""
        # A level that is not meant to hold stands where nothing reaches it.
        far = np.max(self.values, axis=0) + 10 * (1 + np.max(np.abs(self.values), axis=0))
        limits = np.where(np.isfinite(limits), limits, far)
        problems = [self._limited(*lane) for lane in zip(weights, limits, strict=True)]
        methods = [SequentialQuadratic(steps=float(STEPS), inside=float(x)) for x in inside]
        self._take(improve_many(problems, free, methods).free, self._lanes)

    def _limited(self, weights: np.ndarray, limits: np.ndarray) -> Problem:
        held = tuple(
            IndexAtMost(CompositeIndex((term,)), np.asarray(limit), name=f"{name}_at_most")
            for term, limit, name in zip(self._pair, limits, ("first", "second"), strict=True)
        )
        index = CompositeIndex((WeightedTerms(self._pair, weights),), accuracy=np.asarray(np.inf))
        return replace(self._told, objective=index, constraints=(*self._told.constraints, *held))

    def _take(self, free: np.ndarray, count: int) -> None:
        """Verify these free numbers (lanes, k) and take the first `count` that are plans; one shape is compiled."""
        found = verified_plans([self._told] * self._lanes, free, self._settings, self._end_effector)
        new = [one for one in found[:count] if one.result.success]
        values = [[one.terms[term.name].weighted for term in self._pair] for one in new]
        self.plans += new
        self.values = np.concatenate([self.values, np.reshape(values, (-1, 2))])


def _apart(values: np.ndarray) -> list[int]:
    """Numbers of those of a front's members (K, 2), by the first index, that are not next to one taken before.

    Of a cluster its last is taken, the better in the second index; the first member always stays.
    """
    extent = np.ptp(values, axis=0)
    extent = np.where(extent > 0, extent, 1.0)
    taken = [0]
    for number in range(1, len(values)):
        if np.max(np.abs(values[number] - values[taken[-1]]) / extent) > _ALIKE:
            taken.append(number)
        elif taken[-1] != 0:
            taken[-1] = number
    return taken
