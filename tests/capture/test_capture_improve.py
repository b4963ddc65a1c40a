"""Many problems improved side by side: each to its own closed-form optimum, and never to something worse."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.capture.improve import improve_many
from jffsr.errors import InputError
from jffsr.optimizers.constraints import Evaluation
from jffsr.optimizers.sequential_quadratic import SequentialQuadratic


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class OnCircle:
    """The height x[1] on a circle of this radius, not to the left of `left`: least at its lowest point there."""

    radius: jax.Array
    left: jax.Array

    def bounds(self):
        return -3 * jnp.ones(2), 3 * jnp.ones(2)

    def evaluation(self, x, looseness=1.0):
        return Evaluation(x[1], x[1], (x @ x - self.radius**2)[None], (self.left - x[0])[None], 1e-9)


RADII, LEFT = np.array([0.5, 1.0, 2.0]), np.array([-3.0, 0.6, 1.2])
PROBLEMS = [OnCircle(np.array(r), np.array(a)) for r, a in zip(RADII, LEFT, strict=True)]
STARTS = np.stack([RADII, np.zeros(3)], axis=1)


def test_each_comes_to_its_own_optimum_as_far_inside_as_was_asked():
    methods = [SequentialQuadratic(inside=inside) for inside in (0.0, 0.0, 0.1)]
    found = improve_many(PROBLEMS, STARTS, methods)
    assert found.kept.all()
    left = np.array([0.0, 0.6, 1.3])
    expected = np.stack([left, -np.sqrt(RADII**2 - left**2)], axis=1)
    np.testing.assert_allclose(found.free, expected, atol=2e-5)
    np.testing.assert_allclose(found.value, expected[:, 1], atol=1e-6)
    assert np.all(found.jacobians < 76)
    # A point that is kept is not lost where no step is left to better it.
    none = improve_many(PROBLEMS, found.free, [SequentialQuadratic(steps=0.0, inside=0.0)] * 3)
    assert np.all(none.value <= found.value + 1e-12)


@pytest.mark.parametrize(
    ("problems", "free", "methods", "said"),
    [
        ([], STARTS, None, "no problem"),
        (PROBLEMS, STARTS[:2], None, r"\(3, 2\) is expected"),
        (PROBLEMS, STARTS, [SequentialQuadratic()], "1 methods were given for 3"),
        ([PROBLEMS[0], OnCircle(np.ones(2), np.ones(1))], STARTS[:2], None, "problem 1 differs"),
    ],
)
def test_what_does_not_go_together_is_refused(problems, free, methods, said):
    with pytest.raises(InputError, match=said):
        improve_many(problems, free, methods)
