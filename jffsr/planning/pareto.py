"""Terms of a problem's index against each other: a Pareto set of motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import jax.numpy as jnp

from jffsr.errors import InputError
from jffsr.optimizers.pareto import ParetoSet, pareto_set
from jffsr.planning.plan import check_precision
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.reading.did_you_mean import hint
from jffsr.rollouts.motion import Motion
from jffsr.types import Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class TermObjectives:
    """Groups of terms of a problem's index as objectives, each the sum of its weighted terms; static by their names."""

    problem: Problem
    groups: tuple[tuple[str, ...], ...] = field(metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """Those of the problem."""
        return self.problem.bounds()

    def values(self, candidate: Vector) -> Vector:
        """Published forms, (m,)."""
        return self._published(self.problem.motion(candidate))

    def smooth_and_values(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Vector, Vector]:
        """Smooth and published forms, (m,) each, of the same motion."""
        index, motion = self.problem.objective, self.problem.motion(candidate)
        smoothing = index.smoothing.loosened(looseness)
        smooth = {t.name: t.smooth(self.problem.robot, motion, smoothing) / t.scale for t in index.terms}
        return self._sums(smooth), self._published(motion)

    def _published(self, motion: Motion) -> Vector:
        terms = self.problem.objective.breakdown(self.problem.robot, motion)
        return self._sums({name: term.weighted for name, term in terms.items()})

    def _sums(self, terms: dict[str, Scalar]) -> Vector:
        return jnp.stack([sum(terms[name] for name in group) for group in self.groups])


def plan_pareto(
    problem: Problem,
    objectives: Sequence[str | Sequence[str]] | None = None,
    evaluations: int = 4000,
    **keywords: Any,
) -> ParetoSet:
    """The Pareto set of a planning problem; its points are free numbers, its values weighted terms.

    objectives: names of terms, or groups of names whose sum is one objective; each term by default. Every term has to
    count in one of them. Keywords are those of `jffsr.pareto`. A problem with constraints or an uncertainty is refused.
    """
    check_precision("float64")
    if problem.constraints:
        raise InputError("the problem has constraints, which a Pareto set of its terms does not keep")
    if problem.uncertainty is not None:
        raise InputError("the problem has an uncertainty, which measures its whole index and no term of it")
    names = [term.name for term in problem.objective.terms]
    chosen = names if objectives is None else objectives
    groups = tuple((group,) if isinstance(group, str) else tuple(group) for group in chosen)
    given = [name for group in groups for name in group]
    unknown = next((name for name in given if name not in names), None)
    if unknown is not None:
        raise InputError(
            f"'{unknown}' is no term of the index; they are {', '.join(names)}{hint(unknown, names)}"
        )
    once = sorted(given) == sorted(names)
    if not once or len(groups) < 2 or not all(groups):
        raise InputError(
            f"objectives are {list(chosen)}; two groups or more are expected in which each of {', '.join(names)} "
            f"stands once"
        )
    return pareto_set(TermObjectives(problem, groups), evaluations, **keywords)
