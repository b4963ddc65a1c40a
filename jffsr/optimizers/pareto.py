"""Several objectives at once: a Pareto set by NSGA-II, every member of it then polished by gradients.

NSGA-II (Deb, Pratap, Agarwal and Meyarivan, IEEE Trans. Evol. Comput. 6, 2002) and the hypervolume are those of
pymoo (Blank and Deb, IEEE Access 8, 2020), an extra; the objectives are evaluated here, a generation at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.optimizers.interface import box_of
from jffsr.optimizers.polishing import polished
from jffsr.parallel.devices import all_devices
from jffsr.parallel.mapping import spread
from jffsr.pytrees import register_dataclass
from jffsr.types import Array, Scalar, Vector

# What NSGA-II is told of a candidate whose objectives are not finite: anything beats it.
_WORST = 1e30


class MultiObjectiveProblem(Protocol):
    """A box and several objectives, written for one candidate (d,).

    `values` (m,) are what is minimised and reported; `smooth_and_values` gives differentiable stand-ins (m,) together
    with them; a looseness above 1 makes the stand-ins rounder.
    """

    def bounds(self) -> tuple[Vector, Vector]: ...

    def values(self, candidate: Vector) -> Vector: ...

    def smooth_and_values(self, candidate: Vector, looseness: Scalar) -> tuple[Vector, Vector]: ...


@register_dataclass
@dataclass(frozen=True)
class FunctionObjectives:
    """Any function of one candidate that gives several numbers, with bounds (d,) each; the function is static."""

    lower: Array
    upper: Array
    function: Callable[[Vector], Vector] = field(metadata={"static": True})

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds."""
        return self.lower, self.upper

    def values(self, candidate: Vector) -> Vector:
        """The function's numbers."""
        return jnp.stack([jnp.asarray(value) for value in self.function(candidate)])

    def smooth_and_values(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Vector, Vector]:
        """The numbers twice: they are their own stand-ins."""
        values = self.values(candidate)
        return values, values


@dataclass(frozen=True)
class ParetoSet:
    """Candidates none of which is better than another in everything; host arrays, in the order of the first objective.

    points (K, d), values (K, m); hypervolume, between the set and reference (m,); knee, the index of the member
    farthest below the chord of the front, and None where the front is a point; hypervolume_before, of the set
    that NSGA-II left; evaluations and gradient_evaluations counted apart.
    """

    points: np.ndarray
    values: np.ndarray
    hypervolume: float
    knee: int | None
    reference: np.ndarray
    hypervolume_before: float
    evaluations: int
    gradient_evaluations: int


def pareto(
    objectives: Callable[[Vector], Sequence[Scalar] | Vector],
    bounds: tuple[Sequence[float], Sequence[float]],
    evaluations: int = 20_000,
    *,
    population: int = 100,
    polish_iterations: int = 150,
    reference: Sequence[float] | None = None,
    seed: int = 0,
) -> ParetoSet:
    """The Pareto set of objectives(x) -> m numbers, all minimised, written for one candidate (d,) in jax.numpy.

    bounds is (lower, upper), (d,) each; evaluations the budget of the evolution, which is not exceeded;
    polish_iterations, gradients of each member at most, 0 leaves polishing out; reference (m,) the corner of the
    hypervolume, by default a tenth of the front's range beyond its worst. Candidates that are not finite are never
    in the set. Needs the extra `pareto`.
    """
    lower, upper = box_of(bounds)
    return pareto_set(
        FunctionObjectives(lower, upper, objectives),
        evaluations,
        population=population,
        polish_iterations=polish_iterations,
        reference=reference,
        seed=seed,
    )


def pareto_set(
    problem: MultiObjectiveProblem,
    evaluations: int = 20_000,
    *,
    population: int = 100,
    polish_iterations: int = 150,
    reference: Sequence[float] | None = None,
    seed: int = 0,
) -> ParetoSet:
    """The same for a problem; see `pareto`."""
    if not 4 <= population <= evaluations:
        raise InputError(
            f"population is {population}; at least 4 and at most the {evaluations} evaluations are expected"
        )
    if polish_iterations < 0:
        raise InputError(f"polish_iterations is {polish_iterations}; 0 or more are expected")
    positions, values, spent = _evolved(problem, evaluations, population, seed)
    kept = not_dominated(values)
    positions, values = positions[kept], values[kept]
    corner = _reference(values, reference)
    before, gradients = _hypervolume(values, corner), 0
    if polish_iterations and len(values):
        key = jax.random.key(seed)
        with all_devices():
            positions, values, used = jax.device_get(
                polished(problem, positions, values, key, polish_iterations)
            )
        gradients = int(np.sum(used))
        kept = not_dominated(values)
        positions, values = positions[kept], values[kept]
    order = np.lexsort(values.T[::-1])
    positions, values = positions[order], values[order]
    return ParetoSet(
        positions, values, _hypervolume(values, corner), knee_of(values), corner, before, spent, gradients
    )


@program()
def _values(problem: MultiObjectiveProblem, positions: Array) -> Array:
    return spread(problem.values, positions, together=True)


def _evolved(problem: MultiObjectiveProblem, evaluations: int, population: int, seed: int):
    """Positions (K, d) and values (K, m) of the last population, and how many evaluations were spent."""
    start, tell = _library()
    lower, upper = (np.asarray(bound, dtype=float) for bound in problem.bounds())
    shape = jax.eval_shape(problem.values, jnp.asarray(lower)).shape
    if len(shape) != 1 or shape[0] < 2:
        raise InputError(f"the objectives are of shape {shape}; two numbers or more are expected")
    algorithm = start(lower, upper, shape[0], population, seed)
    spent = 0
    while spent < evaluations:
        asked = algorithm.ask()
        if asked is None or len(asked) == 0:
            break
        asked = asked[: evaluations - spent]
        positions = asked.get("X")
        # A generation without duplicates may be short; the program is compiled for one size.
        padded = np.concatenate([positions, np.repeat(positions[-1:], population - len(positions), axis=0)])
        with all_devices():
            found = np.asarray(_values(problem, padded))[: len(positions)]
        finite = np.all(np.isfinite(found), axis=1, keepdims=True)
        tell(algorithm, asked, np.where(finite, found, _WORST))
        spent += len(positions)
    found = algorithm.pop
    return found.get("X"), found.get("F"), spent


def _library():
    """Two functions on pymoo: one makes its NSGA-II ready, one tells it objectives; imported only here."""
    try:
        from pymoo.algorithms.moo.nsga2 import NSGA2, RankAndCrowding
        from pymoo.core.evaluator import Evaluator
        from pymoo.core.problem import Problem
        from pymoo.problems.static import StaticProblem
    except ImportError:
        raise InputError("a Pareto set needs pymoo: pip install 'jffsr[pareto]'") from None

    def start(lower: np.ndarray, upper: np.ndarray, objectives: int, population: int, seed: int):
        # Beyond two objectives the crowding of neighbours says more than that of sides.
        survival = RankAndCrowding(crowding_func="cd" if objectives == 2 else "mnn")
        algorithm = NSGA2(pop_size=population, survival=survival)
        problem = Problem(n_var=lower.size, n_obj=objectives, xl=lower, xu=upper)
        algorithm.setup(problem, seed=seed, termination=("n_gen", 10**9), verbose=False)
        return algorithm

    def tell(algorithm, asked, values: np.ndarray) -> None:
        Evaluator().eval(StaticProblem(algorithm.problem, F=values), asked)
        algorithm.tell(infills=asked)

    return start, tell


def not_dominated(values: np.ndarray) -> np.ndarray:
    """Numbers of those of values (K, m), all to be made small, that are finite, not dominated, and no later equals."""
    finite = np.all(values < _WORST, axis=1)
    one, other = values[:, None], values[None]
    beaten = np.all(other <= one, axis=2) & np.any(other < one, axis=2)
    equal = np.all(one == other, axis=2) & np.tri(len(values), k=-1, dtype=bool)
    return np.flatnonzero(finite & ~np.any((beaten | equal) & finite[None], axis=1))


def _reference(values: np.ndarray, reference: Sequence[float] | None) -> np.ndarray:
    objectives = values.shape[1]
    if reference is not None:
        corner = np.asarray(reference, dtype=float)
        if corner.shape != (objectives,) or not np.all(np.isfinite(corner)):
            raise InputError(f"reference is {list(reference)}; {objectives} finite numbers are expected")
        return corner
    if len(values) == 0:
        return np.full(objectives, np.nan)
    worst = np.max(values, axis=0)
    return worst + 0.1 * np.maximum(worst - np.min(values, axis=0), 1e-12)


def _hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    from pymoo.indicators.hv import HV

    return float(HV(ref_point=reference)(values)) if len(values) else 0.0


def knee_of(values: np.ndarray) -> int | None:
    """Index of the member farthest below the chord, the plane through the extremes, of the front (K, m) scaled to 1.

    None where the front is a point, or no member lies below.
    """
    if len(values) < 3:
        return None
    least, most = np.min(values, axis=0), np.max(values, axis=0)
    if not np.all(most > least):
        return None
    below = 1.0 - np.sum((values - least) / (most - least), axis=1)
    return int(np.argmax(below)) if np.max(below) > 0 else None
