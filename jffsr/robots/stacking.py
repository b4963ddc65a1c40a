"""Many robots of one structure as one pytree whose numbers have a leading axis, and one of them again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import Robot


def stack_robots(robots: Sequence[Robot]) -> Robot:
    """The robots (K of them) as one Robot with a leading axis (K, ...) on every number, host arrays.

    Such a robot goes through `jax.vmap`. Raises InputError for none, and for robots that differ in more than
    numbers: in topology, names or shapes for drawing.
    """
    robots = list(robots)
    if not robots:
        raise InputError("no robot was given; at least one is needed")
    other = first_unlike(robots)
    if other is not None:
        raise InputError(
            f"robot {other} ('{robots[other].name}') differs from robot 0 ('{robots[0].name}') in more than "
            f"numbers (its topology, names, shapes, or the shape of an array)"
        )
    return stacked(robots)


def stacked(trees: Sequence[Any]) -> Any:
    """Pytrees of one structure as one, with a leading axis on every number, host arrays; see `first_unlike`."""
    return jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *trees)


def first_unlike(trees: Sequence[Any]) -> int | None:
    """Index of the first pytree that differs from the first of all in structure or in the shape of a leaf."""

    def kind(tree: Any) -> tuple:
        return jax.tree.structure(tree), [np.shape(leaf) for leaf in jax.tree.leaves(tree)]

    first = kind(trees[0])
    return next((number for number, tree in enumerate(trees) if kind(tree) != first), None)


def unstack_robots(robots: Robot) -> list[Robot]:
    """The K robots of a stacked one; InputError for a robot without the leading axis."""
    count = count_robots(robots)
    return [jax.tree.map(lambda leaf, k=k: np.asarray(leaf)[k], robots) for k in range(count)]


def count_robots(robots: Robot) -> int:
    """K of a robot with a leading axis (K, ...) on every number; InputError where there is none."""
    bodies = robots.num_joints + 1
    shape = np.shape(robots.mass)
    if len(shape) != 2 or shape[1] != bodies or shape[0] == 0:
        raise InputError(
            f"robot '{robots.name}' has masses of the shape {shape}; a stack of robots, with a leading axis on "
            f"every number, has (K, {bodies})"
        )
    leading = {np.shape(leaf)[:1] for leaf in jax.tree.leaves(robots)}
    if leading != {shape[:1]}:
        raise InputError(
            f"the numbers of the stacked robot '{robots.name}' have different leading axes {sorted(leading)}"
        )
    return shape[0]
