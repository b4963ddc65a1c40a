"""Bytes read off a jaxpr, against sums by hand and against what the compiler reserves."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.parallel.chunks import CPU_BYTES, CPU_WHOLE, LANES, chunk_size
from jffsr.parallel.footprint import live_bytes

TABLE = np.arange(1000.0)


def count(function, *arguments) -> int:
    return live_bytes(jax.make_jaxpr(function)(*arguments).jaxpr)


def test_a_chain_keeps_two_values_at_a_time():
    assert count(lambda x: jnp.sin(jnp.cos(jnp.exp(x))), np.zeros(10)) == 2 * 80


def test_a_value_used_later_stays_alive():
    assert count(lambda x: jnp.sin(jnp.cos(jnp.exp(x))) + x, np.zeros(10)) == 3 * 80


def test_what_is_the_same_for_all_candidates_is_free():
    # The table's sine is shared; its product with the candidate is not.
    assert count(lambda x: (jnp.sin(TABLE) * x).sum(), np.zeros(())) == pytest.approx(8000, abs=100)


def test_what_nobody_needs_is_not_counted():
    def function(x):
        jnp.outer(x, x)
        return 2 * x

    assert count(function, np.zeros(100)) == 2 * 800


def test_loops_count_what_they_stack_and_not_every_turn():
    def last(x):
        return jax.lax.scan(lambda c, _: (jnp.sin(c), None), x, length=500)[0]

    def every(x):
        return jax.lax.scan(lambda c, _: (jnp.sin(c), c), x, length=500)[1]

    x = np.zeros(10)
    assert count(last, x) <= 6 * 80
    assert 500 * 80 <= count(every, x) <= 500 * 80 + 6 * 80


def test_a_carry_becomes_a_candidates_own_on_the_way():
    def function(x):
        return jax.lax.scan(lambda c, _: (c[::-1] + x, c), jnp.zeros(10), length=50)[1]

    assert count(function, np.zeros(10)) >= 50 * 80


def test_branches_and_open_loops_are_looked_into():
    def branches(x):
        return jax.lax.cond(x[0] > 0, lambda y: jnp.outer(y, y).sum(), lambda y: y.sum(), x)

    def open_loop(x):
        return jax.lax.while_loop(lambda y: y[0] < 0, lambda y: jnp.outer(y, y).sum(axis=0), x)

    for function in (branches, open_loop):
        assert 80_000 <= count(function, np.zeros(100)) <= 90_000


def test_residuals_of_a_gradient_agree_with_the_compiler():
    def function(x):
        return jax.lax.scan(lambda c, _: (jnp.sin(c) * x, None), x, length=300)[0].sum()

    gradient = jax.grad(function)
    items = np.zeros((64, 40))
    compiled = jax.jit(jax.vmap(gradient)).lower(items).compile()
    reserved = compiled.memory_analysis().temp_size_in_bytes / len(items)
    assert count(gradient, items[0]) == pytest.approx(reserved, rel=0.3)
    assert count(gradient, items[0]) > 20 * count(function, items[0])


@pytest.mark.parametrize("candidates", [1, 7, 16, 50, 1000, 65_536])
def test_chunks_are_alike_and_keep_to_the_limit(candidates):
    for item in (1, 3_000, 230_000, 1_100_000, 10**9):
        chunk = chunk_size(candidates, item)
        assert 1 <= chunk <= candidates
        assert chunk * item <= CPU_WHOLE * CPU_BYTES or chunk <= LANES
        limited = chunk_size(candidates, item, memory=2_000_000)
        assert limited * item <= 2_000_000 or limited == 1
    assert chunk_size(65_536, 30_000) == 32
    assert chunk_size(65_536, 230_000) == chunk_size(65_536, 1_100_000) == LANES
