"""Differential evolution: who is mixed with whom, how, and the stages of the self-adaptive one."""

from __future__ import annotations

from collections import Counter
from itertools import permutations

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats
from shifted_functions import LOWER, UPPER, sphere

from jffsr.compiling import ONCE
from jffsr.errors import InputError
from jffsr.optimizers.de import binomial, mutants
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.population import PopulationState
from jffsr.optimizers.randoms import distinct_others, uniform_pairs, uniforms
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.optimizers.ssade import SSADE, mean_distance

KEY = jax.random.key(9)
PROBLEM = FunctionProblem(LOWER[:3], UPPER[:3], sphere)


@pytest.mark.parametrize("kind", [jnp.float32, jnp.float64])
def test_uniforms_are_uniform_and_open(kind):
    with jax.enable_x64(kind == jnp.float64):
        alone = uniforms(KEY, (20_000,))
        pair = uniform_pairs(KEY, (20_000,))
    for numbers in map(np.asarray, (alone, *pair)):
        assert numbers.dtype == kind
        assert 0 < numbers.min() < 1e-3
        assert 1 - 1e-3 < numbers.max() < 1
        assert stats.kstest(numbers.astype(float), "uniform").pvalue > 0.01
    assert stats.spearmanr(*pair).pvalue > 0.01


def test_others_are_distinct_and_equally_likely():
    """Of five members, each of the 24 triples of others comes equally often."""
    drawn = jax.vmap(lambda key: jnp.stack(distinct_others(key, 5, 3)))(jax.random.split(KEY, 5000))
    for member in range(5):
        counts = Counter(map(tuple, np.asarray(drawn[:, :, member]).tolist()))
        assert set(counts) == set(permutations(set(range(5)) - {member}, 3))
        assert stats.chisquare(list(counts.values())).pvalue > 1e-3


def population(count=6):
    algorithm = SSADE(particles=count)
    state = algorithm.init(KEY, PROBLEM)
    values = jnp.arange(count, 0.0, -1.0)
    progress = jax.tree.map(lambda x: x, state.progress)
    return PopulationState(KEY, state.position, state.kept, values, jnp.zeros(()), progress)


def test_mutants_are_what_their_formulas_say():
    state = population()
    x, best = np.asarray(state.kept), np.asarray(state.progress.best_position)
    rand, pbest, current = map(
        np.asarray, mutants(KEY, state, 0.7, 0.0, ("rand", "pbest", "current_to_best"))
    )
    one, two, three = map(np.asarray, distinct_others(jax.random.split(KEY)[0], 6, 3))
    np.testing.assert_allclose(rand, x[one] + 0.7 * (x[two] - x[three]), rtol=1e-12)
    # The best share of nothing is still one, the member with the least value: the last.
    np.testing.assert_allclose(pbest, x[5] + 0.7 * (x[one] - x[two]), rtol=1e-12)
    np.testing.assert_allclose(current, x + 0.7 * (best - x) + 0.7 * (x[one] - x[two]), rtol=1e-12)


@pytest.mark.parametrize("rate", [0.0, 0.3, 1.0])
def test_crossover_takes_one_number_at_least(rate):
    taken = np.asarray(binomial(KEY, jnp.zeros((5000, 4)), jnp.ones((5000, 4)), rate))
    assert taken.sum(axis=1).min() == (4 if rate == 1.0 else 1)
    assert np.mean(taken) == pytest.approx(0.25 + 0.75 * rate, abs=0.01)
    if rate == 0.0:
        assert np.all(taken.sum(axis=1) == 1)


def test_factors_are_a_cauchy_variable_cut_to_the_unit_interval():
    uniform = (np.arange(5000) + 0.5) / 5000
    factor = np.asarray(SSADE().draw_factor(jnp.asarray(uniform)))
    assert np.all((factor > 0) & (factor <= 1))
    law = stats.cauchy(0.5, 0.1)
    inner = factor < 1
    share = (law.cdf(factor[inner]) - law.cdf(0)) / law.sf(0)
    np.testing.assert_allclose(share, uniform[inner], atol=1e-12)
    assert np.mean(~inner) == pytest.approx(law.sf(1) / law.sf(0), abs=1e-3)


def test_stages():
    stages = SSADE(stage=0.85).stage_number(jnp.array([1.0, 0.86, 0.85, 0.16, 0.14, 0.0]))
    np.testing.assert_array_equal(stages, [1, 1, 2, 2, 3, 3])


def test_mean_distance_is_in_widths_of_the_box():
    members, best = jnp.array([[0.0, 0.0], [3.0, 8.0], [3.0, 0.0]]), jnp.zeros(2)
    assert mean_distance(members, best, jnp.array([1.0, 2.0])) == pytest.approx((0 + 5 + 3) / 3)
    assert mean_distance(members, best, jnp.array([1.0, 0.0])) == pytest.approx((0 + np.hypot(3, 8) + 3) / 3)


def test_a_population_that_gathers_passes_through_the_stages():
    """With all members in one place the distance is zero; the largest is remembered."""
    algorithm = SSADE(particles=6)
    state = population()
    propose = jax.jit(algorithm.propose, compiler_options=ONCE)
    _, largest = propose(PROBLEM, KEY, 0, state)
    assert largest > 0
    gathered = PopulationState(
        KEY, state.position, jnp.ones((6, 3)), state.kept_value, largest, state.progress
    )
    rivals, still = propose(PROBLEM, KEY, 1, gathered)
    assert still >= largest
    assert np.all((rivals >= LOWER[:3]) & (rivals <= UPPER[:3]))


@pytest.mark.parametrize("kind", ["de", "ssade"])
def test_four_members_are_needed(kind):
    with pytest.raises(InputError, match=f"3 particles are fewer than the 4 that '{kind}' needs"):
        build_phases(kind, Settings(particles=3))
