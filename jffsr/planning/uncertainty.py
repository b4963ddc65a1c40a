"""Planning for a robot whose numbers are known only roughly: one plan, judged over many robots."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.objectives.risk import smooth_value_at_risk_mean, value_at_risk_mean
from jffsr.pytrees import register_dataclass
from jffsr.robots.perturbation import perturbed
from jffsr.robots.robot import Robot
from jffsr.types import Array, Scalar

MEASURES = ("expected", "worst_case", "cvar")


@register_dataclass
@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Robots that a plan has to serve, and how their indices become one.

    robots, a stacked Robot, a leading axis (K, ...) on every number; level, in [0, 1], of the conditional value at
    risk: 0 is the mean of all K, 1 the worst, 0.9 the mean of the worst tenth. width, in units of the index, is how
    far the measure is rounded off for gradients.
    """

    robots: Robot
    level: Array
    width: Array

    @classmethod
    def sampled(
        cls,
        robot: Robot,
        count: int,
        measure: str = "cvar",
        *,
        level: float = 0.9,
        seed: int = 0,
        width: float = 0.05,
        **deviations: float,
    ) -> Uncertainty:
        """`count` robots drawn by `jffsr.perturbed` (deviations: mass, inertia, length), judged by a measure.

        measure is expected, worst_case or cvar; level is that of cvar alone. Raises InputError for another.
        """
        if measure not in MEASURES:
            raise InputError(f"measure is '{measure}'; allowed are {', '.join(MEASURES)}")
        if not isinstance(level, Real) or not 0 <= level <= 1:
            raise InputError(f"level is {level!r}; a number in [0, 1] is expected")
        if not isinstance(width, Real) or not 0 < width < np.inf:
            raise InputError(f"width is {width!r}; a positive number is expected")
        level = {"expected": 0.0, "worst_case": 1.0}.get(measure, level)
        robots = perturbed(robot, seed, count, **deviations)
        return cls(robots, np.asarray(level, dtype=float), np.asarray(width, dtype=float))

    def measured(self, index: Callable[[Robot], Scalar]) -> Scalar:
        """The measure of the index of a robot."""
        return value_at_risk_mean(jax.vmap(index)(self.robots), self.level)

    def measured_smooth(
        self, index: Callable[[Robot], tuple[Scalar, Scalar]], looseness: Scalar | float = 1.0
    ) -> tuple[Scalar, Scalar]:
        """The rounded measure of the first of two indices of a robot, and the measure of the second."""
        smooth, value = jax.vmap(index)(self.robots)
        return (
            smooth_value_at_risk_mean(smooth, self.level, self.width * looseness),
            value_at_risk_mean(value, self.level),
        )
