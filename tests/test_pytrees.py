"""Dataclasses as pytrees: structures differ with the class, which JAX's own registration does not see to."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.pytrees import register_dataclass
from jffsr.trajectories.cartesian.timing import Quintic, Trapezoid, Uniform


@register_dataclass
@dataclass(frozen=True)
class Rise:
    height: float
    name: str = field(default="same", metadata={"static": True})
    seen: int = field(default=0, init=False)


@register_dataclass
@dataclass(frozen=True)
class Fall:
    height: float
    name: str = field(default="same", metadata={"static": True})


class Colliding:
    """A structure as a table sees it that looks at nothing but equality."""

    def __init__(self, tree) -> None:
        self.structure = jax.tree.structure(tree)

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other) -> bool:
        return self.structure == other.structure


@pytest.mark.parametrize(
    "nodes",
    [(Rise(1.0), Fall(1.0)), (Quintic(np.array(15.0)), Uniform(np.array(15.0))), (Rise(1.0), Rise(1.0, "b"))],
)
def test_like_structures_of_different_classes_differ(nodes):
    """Also where their hashes collide, at which the program of one class would run for the other."""
    first, second = map(jax.tree.structure, nodes)
    assert first != second
    assert len({Colliding(node) for node in nodes}) == 2
    assert first == jax.tree.structure(jax.tree.map(lambda x: 2 * x, nodes[0]))


def test_every_pair_of_timings_differs():
    laws = [Quintic(np.array(15.0)), Uniform(np.array(15.0)), Trapezoid(np.array(15.0))]
    for a, b in combinations(laws, 2):
        assert jax.tree.structure(a) != jax.tree.structure(b)


def test_it_is_a_pytree_like_jaxs_own():
    """Static fields belong to the structure, paths have the fields' names, other fields are left out."""
    node = Rise(3.0, "name")
    leaves, structure = jax.tree.flatten(node)
    assert leaves == [3.0]
    again = jax.tree.unflatten(structure, [4.0])
    assert (again.height, again.name, again.seen) == (4.0, "name", 0)
    ((path, leaf),) = jax.tree.leaves_with_path({"law": node})
    assert (jax.tree_util.keystr(path), leaf) == ("['law'].height", 3.0)
    with pytest.raises(ValueError, match="Rise"):
        jax.tree.map(jnp.add, node, Fall(3.0, "name"))


def test_a_program_is_traced_once_for_each_class():
    @jax.jit
    @chex.assert_max_traces(n=2)
    def rate(law, time):
        return law(time)[1]

    for duration in (15.0, 30.0):
        assert rate(Quintic(np.array(duration)), duration / 2) == pytest.approx(1.875 / duration)
        assert rate(Uniform(np.array(duration)), duration / 2) == pytest.approx(1 / duration)
