"""Every registered optimizer on the same tests: whoever adds a line to the registry is tested here."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from shifted_functions import LOWER, OPTIMUM, UPPER, Poisoned, sphere

from jffsr.compiling import ONCE, Program
from jffsr.optimizers import driver
from jffsr.optimizers.driver import Stop, run
from jffsr.optimizers.interface import Population
from jffsr.optimizers.qpso import QPSO
from jffsr.optimizers.registry import GENERATIONAL, OPTIMIZERS, Settings, build_phases

D = 3
KEY = jax.random.key(11)
# 607 is no multiple of 12: the last, partial generation is not begun.
SETTINGS = Settings(
    particles=12,
    evaluations=607,
    swarm_evaluations=300,
    starts=2,
    gradient_iterations=25,
    polish_iterations=25,
    memory=3,
)
# What differs from an optimizer's defaults here: the second adapter runs another kind of strategy than the first.
OPTIONS = {"evosax": {"strategy": "PSO"}, "memetic": {"period": 20, "steps": 3}}
# The squared distance from the optimum that is reached; a random search of as many points reaches about 0.5.
BOUND = dict.fromkeys(OPTIMIZERS, 1e-4) | {
    "pso": 1e-2,
    "ga": 2e-2,
    "ga_binary": 0.1,
    "evosax": 1e-2,
    "ssade": 1e-3,
}


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Trial:
    """The shifted sphere, spoilt by numbers that can change without a new compilation.

    percent of all points are NaN; beyond `wall` (of the first number) the value is a violation's, 1e100 times larger.
    """

    percent: jax.Array | int = 0
    wall: jax.Array | float = 1e3
    infinite: jax.Array | float = 1e3
    dimensions: int = field(default=D, metadata={"static": True})

    def bounds(self):
        return jnp.asarray(LOWER[: self.dimensions]), jnp.asarray(UPPER[: self.dimensions])

    def value(self, x):
        value = sphere(x)
        value = jnp.where(x[0] > self.wall, 1e100 * (x[0] - self.wall), value)
        value = jnp.where(x[1] > self.infinite, jnp.inf, value)
        return jnp.where(Poisoned(jnp.asarray(self.percent)).is_poisoned(x), jnp.nan, value)

    def smooth_and_value(self, x, looseness=1.0):
        smooth = sphere(x) + jnp.maximum(x[0] - self.wall, 0.0) ** 2
        value = self.value(x)
        return jnp.where(jnp.isnan(value), jnp.nan, smooth), value


def trial(percent=0, wall=1e3, infinite=1e3) -> Trial:
    return Trial(np.array(percent), np.array(wall), np.array(infinite))


def phases(kind: str, **changes):
    return build_phases(kind, replace(SETTINGS, options=OPTIONS.get(kind, {}), **changes))


@pytest.fixture(scope="module", autouse=True)
def compiled_fast():
    """Half of the tests' time would go to optimising programs that run for milliseconds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(driver, "_advance_jit", Program(driver._advance, static_argnums=4, once=True))
        patch.setattr(driver, "_init", Program(driver._init._function, once=True))
        yield


@cache
def plain(kind: str):
    """The outcome on the sphere in chunks of 20, and every snapshot."""
    snapshots = []
    return run(phases(kind), trial(), KEY, chunk=20, on_chunk=snapshots.append), snapshots


def assert_same(one, other):
    assert one.history == other.history
    assert (one.evaluations, one.gradient_evaluations) == (other.evaluations, other.gradient_evaluations)
    np.testing.assert_array_equal(one.best_position, other.best_position)
    jax.tree.map(np.testing.assert_array_equal, one.population, other.population)


every = pytest.mark.parametrize("kind", OPTIMIZERS)
# Those that compile for long under vmap; what is theirs alone stands in their own tests.
LONG = {"hybrid", "memetic", "ssade", "cma_es", "ga", "ga_binary", "gradient", "evosax", "pso"}


@every
def test_shifted_sphere(kind):
    outcome, _ = plain(kind)
    assert outcome.best_value < BOUND[kind]
    assert outcome.best_value == pytest.approx(
        float(np.sum((outcome.best_position - OPTIMUM[:D]) ** 2)), rel=1e-9
    )
    assert outcome.best_value == min(record.best_value for record in outcome.history)


@every
def test_budget_is_used_and_not_exceeded(kind):
    outcome, _ = plain(kind)
    wanted = {"hybrid": 300, "gradient": 0}.get(kind, 600)
    assert outcome.evaluations == wanted
    if kind in GENERATIONAL:
        assert outcome.gradient_evaluations == 0
    if kind == "memetic":
        assert outcome.gradient_evaluations <= 2 * 3 * (50 // 20)


@every
def test_positions_stay_in_the_box(kind):
    _, snapshots = plain(kind)
    for snapshot in snapshots:
        state = snapshot.state
        places = state.position if hasattr(state, "position") else state.descent.inside
        slack = 1e-15 * (UPPER[:D] - LOWER[:D])
        assert np.all((places >= LOWER[:D] - slack) & (places <= UPPER[:D] + slack))


@every
def test_chunks_do_not_change_the_result(kind):
    assert_same(run(phases(kind), trial(), KEY, chunk=7), plain(kind)[0])


@every
def test_resume_gives_the_same_bits(kind):
    outcome, snapshots = plain(kind)
    for snapshot in snapshots[:-1:2]:
        state = jax.tree.map(
            lambda x: x if jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key) else np.asarray(x),
            snapshot.state,
        )
        assert_same(run(phases(kind), trial(), KEY, chunk=20, resume=replace(snapshot, state=state)), outcome)


@every
@pytest.mark.parametrize("percent", [30, 95])
def test_candidates_that_are_nan_never_win(kind, percent):
    outcome = run(phases(kind), trial(percent=percent), KEY, chunk=20)
    assert np.isfinite(outcome.best_value)
    value = trial(percent=percent).value(jnp.asarray(outcome.best_position))
    assert float(value) == pytest.approx(outcome.best_value, rel=1e-9)


@every
def test_nothing_but_nan(kind):
    outcome = run(phases(kind), trial(percent=100), KEY, chunk=20)
    assert outcome.best_value == np.inf
    assert np.all((outcome.best_position >= LOWER[:D]) & (outcome.best_position <= UPPER[:D]))


@every
def test_values_of_every_size(kind):
    """Beyond a wall values are 1e100 times larger, and infinite beyond another; the optimum is at the first wall."""
    wall, infinite = OPTIMUM[0] - 0.5, OPTIMUM[1] + 0.3
    given = np.tile([wall - 0.5, infinite - 1.0, 0.0], (2, 1))
    outcome = run(
        phases(kind),
        trial(wall=wall, infinite=infinite),
        KEY,
        chunk=20,
        population=Population(given, np.full(2, np.inf)),
    )
    started = float(sphere(given[0]))
    assert 0.25 <= outcome.best_value <= started
    # The descent follows a stand-in that knows no wall, and may find nothing better on its side.
    assert outcome.best_value < started or kind == "gradient"
    assert outcome.best_position[0] <= wall


@every
def test_given_population_is_not_lost(kind):
    given = Population(np.tile(OPTIMUM[:D] + 1e-6, (2, 1)), np.full(2, np.inf))
    outcome = run(phases(kind), trial(), KEY, chunk=20, population=given)
    assert outcome.best_value < (1e-2 if kind == "cma_es" else 4e-12)


@partial(jax.jit, static_argnums=0, compiler_options=ONCE)
def few_steps(length, optimizers, keys):
    """Best values and populations of optimizers (b, ...) and keys (b,) after a few steps, in one call."""

    def one(optimizer, key):
        start = optimizer.init(key, trial(), None)
        state = jax.lax.scan(lambda s, _: (optimizer.step(trial(), s), None), start, length=length)[0]
        return state.progress.best_value, optimizer.population(state)

    return jax.vmap(one)(optimizers, keys)


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] if kind in LONG else []) for kind in OPTIMIZERS]
)
def test_vmap_over_hyperparameters_and_seeds(kind):
    """Two seeds times two settings of every traced hyperparameter in one call, against one run at a time."""
    phase = phases(kind)[-1]
    first = jax.tree.map(lambda leaf: jnp.asarray(leaf, float), phase.optimizer)
    other = jax.tree.map(lambda leaf: 0.97 * leaf, first)
    runs = [(optimizer, key) for optimizer in (first, other) for key in jax.random.split(KEY, 2)]
    optimizers = jax.tree.map(lambda *leaves: jnp.stack(leaves), *(optimizer for optimizer, _ in runs))
    best, populations = few_steps(4, optimizers, jnp.stack([jax.random.fold_in(key, 0) for _, key in runs]))
    for i, (optimizer, key) in enumerate(runs):
        alone = run([replace(phase, optimizer=optimizer, stop=Stop(iterations=4.0))], trial(), key, chunk=20)
        np.testing.assert_allclose(best[i], alone.best_value, rtol=1e-9)
        np.testing.assert_allclose(
            populations.positions[i], alone.population.positions, rtol=1e-9, atol=1e-12
        )
    assert len(np.unique(best)) >= 2


def test_one_trace_for_64_settings_of_20_seeds():
    """The sweep that people run: one compiled call, whatever the settings' numbers."""
    traced = 0

    def best(optimizer, key):
        nonlocal traced
        traced += 1
        start = optimizer.init(key, trial(), None)
        state = jax.lax.scan(lambda s, _: (optimizer.step(trial(), s), None), start, length=3)[0]
        return state.progress.best_value

    count = 64
    settings = QPSO(
        iterations=np.full(count, 3.0),
        contraction_start=np.linspace(0.6, 1.4, count),
        contraction_end=np.linspace(0.3, 0.7, count),
        particles=5,
    )
    swept = jax.jit(jax.vmap(jax.vmap(best, in_axes=(None, 0)), in_axes=(0, None)), compiler_options=ONCE)
    for seed in range(2):
        found = swept(settings, jax.random.split(jax.random.key(seed), 20))
        assert found.shape == (64, 20)
        assert len(np.unique(found)) > 1000
    assert traced == 1
