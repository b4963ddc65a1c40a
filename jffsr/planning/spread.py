"""How one plan's index is spread over many robots, which need not be those that it was planned for."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np

from jffsr.parallel.mapping import map_batch
from jffsr.planning.problem import Problem
from jffsr.robots.robot import Robot
from jffsr.types import Array, Vector


def index_over(problem: Problem, free: Vector, robots: Robot) -> np.ndarray:
    """The published index (K,) of the plan with the free numbers (k,) on each of K stacked robots.

    The joints follow the same law whatever robot they move. `jffsr.perturbed` draws robots.
    """
    nominal = replace(problem, uncertainty=None)
    count = len(robots.mass)
    return np.asarray(
        map_batch(_index, (_repeated(nominal, count), _repeated(np.asarray(free), count), robots))
    )


def _repeated(tree, count: int):
    return jax.tree.map(lambda leaf: np.broadcast_to(np.asarray(leaf), (count, *np.shape(leaf))), tree)


def _index(candidate: tuple[Problem, Vector, Robot]) -> Array:
    problem, free, robot = candidate
    return replace(problem, robot=robot).value(free)
