"""What is searched, and how: a problem with constraints by its merit and the augmented Lagrangian."""

from __future__ import annotations

from jffsr.errors import InputError
from jffsr.optimizers.augmented import constrained_phases
from jffsr.optimizers.constraints import Feasible
from jffsr.optimizers.driver import Phase
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.planning.codesign import CoDesign
from jffsr.planning.problem import Problem
from jffsr.types import Scalar


def search_of(
    problem: Problem | CoDesign, optimizer: str, settings: Settings
) -> tuple[list[Phase], OptimizationProblem]:
    """The phases of a registered optimizer and what they minimise.

    Without constraints the problem itself; with some its merit, descents being those of the augmented Lagrangian.
    """
    names = [constraint.name for constraint in problem.constraints]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"two constraints are named '{twice}'; names must differ")
    phases = build_phases(optimizer, settings)
    return constrained_phases(phases) if problem.constraints else phases, searchable(problem)


def searchable(problem: Problem | CoDesign) -> OptimizationProblem:
    """The problem itself, or with constraints the one whose value is the merit."""
    return Feasible(problem) if problem.constraints else problem


def found_index(problem: Problem, best: Scalar, nominal: Scalar, measure: Scalar) -> Scalar:
    """The index of what a search found: its best value, but where that is a merit, under constraints.

    nominal is the index of the robot itself at the planner's step, measure that over the uncertain robots.
    """
    if not problem.constraints:
        return best
    return nominal if problem.uncertainty is None else measure
