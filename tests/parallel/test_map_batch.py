"""map_batch on one device: what it returns, in how much memory, and how often it traces."""

from __future__ import annotations

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.errors import InputError
from jffsr.parallel import cores
from jffsr.parallel.mapping import evaluate, map_batch, spread

WEIGHTS = np.linspace(0.1, 1.0, 5)


def swing(candidate):
    """A small rollout: a loop over time with everything that a plan's index has."""

    def step(state, t):
        state = state + 0.1 * jnp.sin(state * candidate["gain"] + t)
        return state, jnp.max(jnp.abs(state))

    state, largest = jax.lax.scan(step, candidate["start"] * WEIGHTS, jnp.arange(40.0))
    return {"cost": jnp.sum(state**2) + jnp.max(largest), "good": largest[-1] < 2.0, "end": state}


def batch_of(count: int):
    draw = np.random.default_rng(count)
    return {"gain": draw.normal(size=count), "start": draw.normal(size=(count, 5))}


@pytest.mark.parametrize("count", [1, 7, 23])
def test_every_chunk_gives_what_one_at_a_time_gives(count):
    batch = batch_of(count)
    singly = jax.jit(swing)
    one_by_one = [singly(jax.tree.map(lambda x, i=i: x[i], batch)) for i in range(count)]
    expected = jax.tree.map(lambda *x: np.stack(x), *one_by_one)
    for chunk in (1, 8, 10, 100):
        found = map_batch(swing, batch, chunk=chunk)
        chex.assert_trees_all_equal_shapes_and_dtypes(found, expected)
        chex.assert_trees_all_close(found, expected, rtol=1e-13)
    for options in ({}, {"memory": 5000}):
        chex.assert_trees_all_close(map_batch(swing, batch, **options), expected, rtol=1e-13)


def test_it_does_not_matter_which_chunk_a_candidate_is_in():
    batch = batch_of(32)
    found = map_batch(swing, batch, chunk=8)
    moved = map_batch(swing, jax.tree.map(lambda x: np.roll(x, 16, axis=0), batch), chunk=8)
    jax.tree.map(lambda a, b: np.testing.assert_array_equal(np.roll(a, 16, axis=0), b), found, moved)


def test_a_poisoned_candidate_spoils_no_other():
    batch = batch_of(21)
    clean = map_batch(swing, batch, chunk=8)
    batch["start"][20] = np.nan
    found = map_batch(swing, batch, chunk=8)
    assert np.isnan(found["cost"][20])
    np.testing.assert_array_equal(found["cost"][:20], clean["cost"][:20])


def test_memory_grows_with_the_chunk_and_not_with_the_batch():
    gradient = jax.grad(lambda candidate: swing(candidate)["cost"])

    def needed(count: int, **options) -> int:
        program = jax.jit(lambda batch: spread(gradient, batch, **options))
        return program.lower(batch_of(count)).compile().memory_analysis().temp_size_in_bytes

    # The padded copy of the batch itself (48 bytes a candidate, in and out) is not what is bounded.
    small, large = needed(512, chunk=16), needed(8192, chunk=16)
    assert large - small <= 4 * 48 * 8192
    assert needed(8192, chunk=256) > 6 * large - 6 * 4 * 48 * 8192
    assert needed(8192, memory=200_000) <= 2 * 200_000 + 4 * 48 * 8192


def test_one_trace_for_each_shape():
    traced = chex.assert_max_traces(swing, n=2)
    for count in (19, 40):
        for _ in range(3):
            map_batch(traced, batch_of(count), chunk=8)


def test_it_works_within_transformations():
    batch = batch_of(11)

    def total(scale, chunk):
        scaled = {"gain": batch["gain"], "start": scale * batch["start"]}
        return map_batch(lambda item: swing(item)["cost"] * scale, scaled, chunk=chunk).sum()

    eager = jax.grad(total)(1.1, 4)
    for compiled in (jax.jit(jax.grad(total), static_argnums=1)(1.1, chunk) for chunk in (4, 11)):
        np.testing.assert_allclose(compiled, eager, rtol=1e-12)
    step = 1e-6
    slope = (total(1.1 + step, 4) - total(1.1 - step, 4)) / (2 * step)
    np.testing.assert_allclose(eager, slope, rtol=1e-7)


def test_evaluations_within_a_batch_are_only_vectorized():
    inner = batch_of(64)

    def outer(scale):
        return evaluate(lambda item: swing(item)["cost"] * scale, inner).sum()

    loops = str(jax.make_jaxpr(lambda s: spread(outer, s, chunk=2))(np.arange(6.0))).count("scan[")
    assert loops == 2  # the chunks of the outer batch and the time of the inner function


def test_bad_input_is_refused():
    with pytest.raises(InputError, match=r"shapes \(3,\), \(4,\); one leading axis"):
        map_batch(lambda x: x[0], (np.zeros(3), np.zeros(4)))
    with pytest.raises(InputError, match="one leading axis"):
        map_batch(lambda x: x, np.zeros(()))
    with pytest.raises(InputError, match="chunk is 0; a positive number"):
        map_batch(swing, batch_of(3), chunk=0)
    with pytest.raises(InputError, match="memory is -5; a positive number"):
        map_batch(swing, batch_of(3), memory=-5)


def test_cores_are_to_be_asked_for_before_jax_runs(monkeypatch):
    running = len(jax.local_devices(backend="cpu"))
    monkeypatch.delenv("XLA_FLAGS", raising=False)
    monkeypatch.setattr(cores, "available_cores", lambda: running + 1)
    with pytest.raises(InputError, match=f"already runs with {running} CPU device"):
        cores.use_all_cores()
    monkeypatch.setattr(cores, "available_cores", lambda: running)
    assert cores.use_all_cores() == running
    monkeypatch.setenv("XLA_FLAGS", "--xla_force_host_platform_device_count=77")
    assert cores.use_all_cores() == running
