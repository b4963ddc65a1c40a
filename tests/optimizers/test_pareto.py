"""Pareto sets of problems whose front, hypervolume and knee are known in closed form."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.optimizers.pareto import ParetoSet, knee_of, pareto

BOX = (np.zeros(5), np.ones(5))
TARGETS = np.array([[0.2, 0.7], [0.9, 0.3]])


def zdt1(x):
    """Zitzler, Deb and Thiele (2000): the front is f2 = 1 - sqrt(f1), the other numbers at their bound."""
    g = 1 + 9 * jnp.mean(x[1:])
    return x[0], g * (1 - jnp.sqrt(x[0] / g))


def zdt2(x):
    """The front f2 = 1 - f1^2 bulges outwards: sums with weights find its ends alone."""
    g = 1 + 9 * jnp.mean(x[1:])
    return x[0], g * (1 - (x[0] / g) ** 2)


def spheres(x):
    """Half squared distances from two points: the set is the line between them."""
    return [0.5 * jnp.sum((x - target) ** 2) for target in TARGETS]


@pytest.fixture(scope="module")
def lines() -> ParetoSet:
    return pareto(
        spheres, ([-1.0, -1.0], [2.0, 2.0]), 600, population=20, reference=[0.4, 0.4], polish_iterations=90
    )


def off_the_line(points):
    along = TARGETS[1] - TARGETS[0]
    share = (points - TARGETS[0]) @ along / (along @ along)
    return share, np.linalg.norm(points - TARGETS[0] - share[:, None] * along, axis=1)


def test_every_member_ends_on_the_line_between_two_targets(lines):
    share, off = off_the_line(lines.points)
    assert len(lines.points) >= 10
    assert np.all((share > -1e-4) & (share < 1 + 1e-4))
    assert np.median(off) < 1e-4
    # On the line sqrt(2 f1) + sqrt(2 f2) is its length, and nowhere less.
    gap = np.sum(np.sqrt(2 * lines.values), axis=1) - np.linalg.norm(TARGETS[1] - TARGETS[0])
    assert np.all(gap > -1e-12)
    assert np.max(gap) < 1e-5
    assert np.max(share) - np.min(share) > 0.8


def test_hypervolume_is_the_area_of_the_steps(lines):
    """Summed here over the sorted front; of the whole front, sqrt(f1) + sqrt(f2) constant, by quadrature."""
    values = lines.values[np.argsort(lines.values[:, 0])]
    assert np.all(values < 0.4)
    edges = np.append(values[1:, 0], 0.4)
    steps = np.sum((edges - values[:, 0]) * (0.4 - values[:, 1]))
    assert lines.hypervolume == pytest.approx(steps, rel=1e-12)
    length = np.linalg.norm(TARGETS[1] - TARGETS[0]) / np.sqrt(2)
    f1 = np.linspace(0, 0.4, 200_001)
    whole = np.mean(0.4 - np.maximum(length - np.sqrt(f1), 0.0) ** 2) * 0.4
    assert 0.95 * whole < lines.hypervolume < whole
    assert lines.hypervolume >= lines.hypervolume_before


def test_knee_is_farthest_below_the_chord(lines):
    """The front is symmetric, so that the knee is its middle."""
    share, _ = off_the_line(lines.points)
    assert lines.knee is not None
    assert share[lines.knee] == pytest.approx(0.5, abs=0.1)
    f1 = np.linspace(0, 1, 101)
    assert knee_of(np.stack([f1, (1 - np.sqrt(f1)) ** 2], axis=1)) == 25
    assert knee_of(np.stack([f1, 1 - f1**2], axis=1)) is None
    assert knee_of(np.array([[0.0, 1.0]])) is None


def test_counts_and_seeds(lines):
    assert lines.evaluations == 600
    assert 0 < lines.gradient_evaluations <= 20 * 90
    again = pareto(
        spheres, ([-1.0, -1.0], [2.0, 2.0]), 600, population=20, reference=[0.4, 0.4], polish_iterations=90
    )
    np.testing.assert_array_equal(again.points, lines.points)
    other = pareto(spheres, ([-1.0, -1.0], [2.0, 2.0]), 590, population=20, polish_iterations=0, seed=1)
    assert other.evaluations == 590
    assert other.gradient_evaluations == 0
    assert other.hypervolume == other.hypervolume_before
    assert not np.array_equal(other.points[:5], lines.points[:5])


@pytest.mark.parametrize(
    ("case", "front"),
    [
        pytest.param(zdt1, lambda f: 1 - np.sqrt(f), id="zdt1", marks=pytest.mark.slow),
        pytest.param(zdt2, lambda f: 1 - f**2, id="zdt2"),
    ],
)
def test_polished_members_lie_on_the_front(case, front):
    found = pareto(case, BOX, 1000, population=20, polish_iterations=150, reference=[1.1, 1.1])
    raw = pareto(case, BOX, 1000, population=20, polish_iterations=0, reference=[1.1, 1.1])
    gap, before = (s.values[:, 1] - front(s.values[:, 0]) for s in (found, raw))
    assert np.all(gap > -1e-12)
    assert np.median(gap) < 1e-4 < 1e-2 < np.median(before)
    assert found.hypervolume > found.hypervolume_before == raw.hypervolume
    # No member is dominated by one it could have begun at.
    worse = np.all(raw.values[None] <= found.values[:, None], axis=2) & np.any(
        raw.values[None] < found.values[:, None], axis=2
    )
    assert not np.any(worse)


def test_what_is_not_finite_is_never_in_the_set():
    def poisoned(x):
        first, second = spheres(x)
        return jnp.where(jnp.sin(60 * x[0]) > 0.5, jnp.nan, first), second

    found = pareto(poisoned, ([-1.0, -1.0], [2.0, 2.0]), 400, population=20, polish_iterations=30)
    assert len(found.points) > 3
    assert np.all(np.isfinite(found.values))
    assert np.all(np.sin(60 * found.points[:, 0]) <= 0.5)
    nothing = pareto(lambda x: (jnp.nan * x[0], x[1]), BOX, 40, population=20, polish_iterations=30)
    assert len(nothing.points) == nothing.hypervolume == 0
    assert nothing.knee is None


def test_three_objectives():
    """Squared distances from three points: the set is their triangle."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    found = pareto(
        lambda x: jnp.sum((x - corners) ** 2, axis=1),
        ([-1.0, -1.0], [2.0, 2.0]),
        600,
        population=20,
        polish_iterations=60,
    )
    assert found.values.shape == (len(found.points), 3)
    assert np.min(found.points) > -5e-3
    assert np.max(np.sum(found.points, axis=1)) < 1 + 5e-3


@pytest.mark.parametrize(
    ("keywords", "sentence"),
    [
        ({"population": 3}, "population is 3; at least 4 and at most the 100 evaluations"),
        ({"population": 200}, "population is 200"),
        ({"polish_iterations": -1}, "polish_iterations is -1"),
        ({"population": 4, "reference": [1.0]}, "reference is .*; 2 finite numbers are expected"),
        ({"objectives": lambda x: x[:1]}, "the objectives are of shape"),
        ({"bounds": ([0.0], [np.inf])}, "bounds must be finite"),
    ],
)
def test_bad_input_is_refused(keywords, sentence):
    arguments = {
        "objectives": spheres,
        "bounds": ([-1.0, -1.0], [2.0, 2.0]),
        "evaluations": 100,
        "population": 50,
    }
    with pytest.raises(InputError, match=sentence):
        pareto(**(arguments | keywords))
