"""What is searched: planning problems of several systems, from their configurations."""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.planning.problem import Problem
from jffsr.study.building import build_problem
from jffsr.study.config import load_config


@dataclass(frozen=True)
class Scenario:
    """A configuration with replaced values, and what it is in a few words."""

    name: str
    config: str
    about: str
    overrides: tuple[str, ...] = ()

    def problem(self) -> Problem:
        """The planning problem."""
        return build_problem(load_config(self.config, self.overrides))


SCENARIOS = (
    Scenario("wu6", "composite_wu6", "composite index, six axes, 12 free numbers"),
    Scenario("wu6 tight", "composite_wu6_tight", "the same with limits that no plan found meets"),
    Scenario("wu6 momentum", "composite_wu6_momentum", "the same with momentum left over"),
    Scenario("7-dof", "composite_7dof", "composite index with the tool's place, seven axes, 14 free numbers"),
    Scenario("Hu torque", "hu_2011", "minimum torque, planar, degree 8, 6 free numbers"),
    Scenario("wu6 torque", "wu_2018_torque", "minimum torque, six axes, polynomials"),
    Scenario(
        "7-dof spline",
        "composite_7dof",
        "the index of 7-dof with clamped B-splines, as capture planning has them",
        ("trajectory.kind=bspline",),
    ),
)
