"""Many problems on few lanes: each is solved as it would be alone, attempts are counted, variants stop together."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.capture.batch import restore_many
from jffsr.errors import InputError
from jffsr.optimizers.constraints import Evaluation


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Circle:
    """x on a circle of this radius, and not to the left of `left`."""

    radius: jax.Array
    left: jax.Array

    def bounds(self):
        return -3 * jnp.ones(2), 3 * jnp.ones(2)

    def evaluation(self, x, looseness=1.0):
        zero = jnp.zeros(())
        return Evaluation(zero, zero, (x @ x - self.radius**2)[None], (self.left - x[0])[None], 1e-10)


RADII = np.array([0.5, 1.0, 1.5, 2.0, 2.5])
PROBLEMS = [Circle(np.array(r), np.array(0.1)) for r in RADII]
STARTS = np.broadcast_to(np.array([[0.2, -0.3], [0.7, 0.4], [-1.0, 1.0]]), (5, 3, 2)).copy()


@pytest.fixture(scope="module")
def on_two_lanes():
    return restore_many(PROBLEMS, STARTS, lanes=2)


def test_every_problem_is_solved_from_its_first_good_start(on_two_lanes):
    assert on_two_lanes.kept.all()
    np.testing.assert_allclose(np.linalg.norm(on_two_lanes.free, axis=1), RADII, atol=1e-10)
    assert np.all(on_two_lanes.free[:, 0] >= 0.1)
    np.testing.assert_array_equal(on_two_lanes.attempts, [1, 1, 1, 1, 2])


def test_each_is_solved_as_it_is_alone(on_two_lanes):
    for k in range(4):
        alone = restore_many(PROBLEMS[k : k + 1], STARTS[k : k + 1, :1], lanes=2)
        np.testing.assert_allclose(alone.free[0], on_two_lanes.free[k], atol=1e-12)
        assert alone.jacobians[0] == on_two_lanes.jacobians[k]


def test_variants_of_a_solved_task_are_left_alone():
    progress = []
    found = restore_many(
        PROBLEMS,
        STARTS[:, 1:],
        task_of=[0, 0, 1, 1, 1],
        lanes=2,
        on_progress=lambda solved, left: progress.append((solved, left)),
    )
    # The first variant of each task comes first, and solves it.
    np.testing.assert_array_equal(found.kept, [True, False, True, False, False])
    np.testing.assert_array_equal(found.attempts, [1, 0, 1, 0, 0])
    assert progress[-1] == (2, 0)


def test_what_cannot_be_solved_says_so_after_every_start():
    beyond = [Circle(np.array(1.0), np.array(2.0)), PROBLEMS[1]]
    found = restore_many(beyond, STARTS[:2, 1:], lanes=2)
    np.testing.assert_array_equal(found.kept, [False, True])
    np.testing.assert_array_equal(found.attempts, [2, 1])


@pytest.mark.parametrize(
    ("problems", "starts", "said"),
    [
        ([], STARTS, "no problem"),
        (PROBLEMS, STARTS[:4], r"\(5, s, 2\) is expected"),
        ([PROBLEMS[0], Circle(np.ones(2), np.array(0.1))], STARTS[:2], "problem 1 differs"),
    ],
)
def test_what_does_not_go_together_is_refused(problems, starts, said):
    with pytest.raises(InputError, match=said):
        restore_many(problems, starts)
