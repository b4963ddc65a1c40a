"""Selection, crossover, mutation and coding against what their definitions say."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from shifted_functions import LOWER, UPPER, sphere

from jffsr.compiling import ONCE
from jffsr.optimizers.genetic_binary import BinaryGA
from jffsr.optimizers.genetic_real import RealGA, polynomial, spread_factor
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.population import PopulationState
from jffsr.optimizers.selection import select, shares

PROBLEM = FunctionProblem(LOWER[:3], UPPER[:3], sphere)
KEY = jax.random.key(5)
VALUES = np.array([4.0, 1.0, 3.0, 1.5])


def frequencies(values, scheme, **keywords):
    drawn = np.asarray(select(KEY, jnp.asarray(values), 40_000, scheme, **keywords))
    return np.bincount(drawn, minlength=len(values)) / drawn.size


def test_roulette_is_proportional_to_the_distance_from_the_worst():
    expected = (4.0 - VALUES) / np.sum(4.0 - VALUES)
    for scaled in (VALUES, VALUES - 1e3, 1e100 * VALUES, -1e300 + 1e299 * VALUES):
        np.testing.assert_allclose(frequencies(scaled, "roulette"), expected, atol=0.01)


def test_roulette_with_infinite_and_equal_values():
    np.testing.assert_allclose(
        frequencies([np.inf, 1.0, np.inf, 1.0], "roulette"), [0, 0.5, 0, 0.5], atol=0.01
    )
    np.testing.assert_allclose(frequencies([np.inf] * 4, "roulette"), 0.25, atol=0.01)
    np.testing.assert_allclose(
        frequencies([1.0, 1.0, 1e100, np.inf], "roulette"), [0.5, 0.5, 0, 0], atol=0.01
    )
    # The spread itself would overflow.
    np.testing.assert_allclose(shares(jnp.array([-1.5e308, 1.5e308]), "roulette"), [1.0, 0.0])


def test_rank_selection():
    np.testing.assert_allclose(frequencies([4.0, 1.0, np.inf, 1.5], "rank"), [0.2, 0.4, 0.1, 0.3], atol=0.01)


@pytest.mark.parametrize("contestants", [2, 3])
def test_tournament(contestants):
    """The member of rank r of n wins with probability ((n - r)^k - (n - r - 1)^k)/n^k."""
    rank, n = np.array([2, 0, 3, 1]), 4
    expected = ((n - rank) ** contestants - (n - rank - 1) ** contestants) / n**contestants
    found = frequencies([4.0, 1.0, np.inf, 1.5], "tournament", contestants=contestants)
    np.testing.assert_allclose(found, expected, atol=0.01)


@pytest.mark.parametrize("bits", [1, 8, 20, 30])
def test_every_code_comes_back(bits):
    coder = BinaryGA(bits=bits)
    codes = np.unique(np.random.default_rng(0).integers(0, 2**bits, 200))
    written = np.array([[int(digit) for digit in f"{code:0{bits}b}"] for code in codes]).astype(bool)
    share = coder.decode(jnp.asarray(written))
    np.testing.assert_allclose(share, codes / (2**bits - 1), rtol=1e-14)
    np.testing.assert_array_equal(coder.encode(share), written)


@partial(jax.jit, compiler_options=ONCE)
def proposed(algorithm, problem, key, state):
    return algorithm.propose(problem, key, 0, state)[0]


def generation(algorithm, values, problem=PROBLEM, key=KEY):
    state = algorithm.init(key, problem)
    state = PopulationState(key, state.position, state.kept, jnp.asarray(values), (), state.progress)
    return np.asarray(state.kept), np.asarray(proposed(algorithm, problem, key, state))


def test_children_without_crossover_and_mutation_are_their_parents():
    parents, children = generation(BinaryGA(0.0, 0.0, particles=7), np.arange(7.0))
    step = (UPPER[:3] - LOWER[:3]) / (2**20 - 1)
    nearest = np.min(np.max(np.abs(children[:, None] - parents[None]) / step, axis=2), axis=1)
    assert np.all(nearest <= 0.5 + 1e-6)
    parents, children = generation(RealGA(crossover_rate=0.0, mutations=0.0, particles=7), np.arange(7.0))
    assert all(any(np.array_equal(child, parent) for parent in parents) for child in children)


def test_one_point_crossover_cuts_the_string_once():
    coder = BinaryGA(1.0, bits=6, particles=2)
    swapped = np.asarray(coder._swapped(KEY, (4000, 18)))
    cuts = np.argmax(swapped, axis=1)
    np.testing.assert_array_equal(swapped, np.arange(18) >= cuts[:, None])
    assert set(cuts) == set(range(1, 18))
    assert stats.chisquare(np.bincount(cuts)[1:]).pvalue > 0.01


def test_bits_mutate_at_their_rate():
    """From zeros, the ones among the children's bits are mutations."""
    coder = BinaryGA(0.8, 0.03, particles=500)
    lower = FunctionProblem(np.zeros(3), np.ones(3), sphere)
    state = coder.init(KEY, lower)
    zeros = jnp.zeros_like(state.kept)
    state = PopulationState(KEY, zeros, zeros, jnp.zeros(500), (), state.progress)
    children = coder.encode(proposed(coder, lower, KEY, state))
    count = int(np.sum(children))
    assert stats.binomtest(count, children.size, 0.03).pvalue > 0.01


@pytest.mark.parametrize("index", [2.0, 15.0])
def test_crossover_spread_has_its_density(index):
    """Deb and Agrawal: 0.5 (n + 1) b^n below 1 and 0.5 (n + 1)/b^(n + 2) above, as a distribution function."""
    uniform = (np.arange(2000) + 0.5) / 2000
    spread = np.asarray(spread_factor(jnp.asarray(uniform), index))

    def below(b):
        return np.where(b <= 1, 0.5 * b ** (index + 1), 1 - 0.5 / b ** (index + 1))

    np.testing.assert_allclose(below(spread), uniform, rtol=1e-10)


def test_polynomial_mutation_has_its_density():
    """0.5 (n + 1) (1 - |x|)^n."""
    uniform = (np.arange(2000) + 0.5) / 2000
    change, index = np.asarray(polynomial(jnp.asarray(uniform), 20.0)), 20.0
    below = np.where(change < 0, 0.5 * (1 + change) ** (index + 1), 1 - 0.5 * (1 - change) ** (index + 1))
    np.testing.assert_allclose(below, uniform, rtol=1e-10)


@pytest.mark.parametrize("crossover", ["sbx", "blend"])
def test_children_of_a_pair_are_about_it(crossover):
    one, two = jnp.array([[0.0, 0.0]]), jnp.array([[1.0, -2.0]])
    ga = RealGA(crossover=crossover, crossover_index=10.0)
    many = jax.vmap(lambda key: ga.cross(key, one, two))(jax.random.split(KEY, 4000))
    first, second = np.asarray(many[0])[:, 0], np.asarray(many[1])[:, 0]
    np.testing.assert_allclose(np.mean(first, axis=0), [0.5, -1.0], atol=0.05)
    if crossover == "sbx":
        np.testing.assert_allclose(first + second, np.tile([1.0, -2.0], (4000, 1)), atol=1e-12)
    else:
        low, high = np.array([-0.5, -3.0]), np.array([1.5, 1.0])
        assert np.all((first >= low) & (first <= high))
        assert stats.kstest(first[:, 0], stats.uniform(-0.5, 2.0).cdf).pvalue > 0.01


@pytest.mark.parametrize("elitism", [True, False])
def test_elitism_saves_the_best_parent(elitism):
    ga = BinaryGA(particles=4, elitism=elitism)
    state = ga.init(KEY, PROBLEM)
    state = PopulationState(
        KEY, state.position, state.kept + 1, jnp.array([4.0, 2.0, 9.0, 3.0]), (), state.progress
    )
    kept, value, _ = ga.keep(state, jnp.array([5.0, 6.0, jnp.inf, 7.0]))
    if elitism:
        np.testing.assert_array_equal(value, [5.0, 6.0, 2.0, 7.0])
        np.testing.assert_array_equal(kept[2], state.kept[1])
    else:
        np.testing.assert_array_equal(value, [5.0, 6.0, np.inf, 7.0])
        np.testing.assert_array_equal(kept, state.position)
