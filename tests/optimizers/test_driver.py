"""The one loop: resuming, chunks, stopping, interrupts, and how often it is compiled."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import chex
import jax
import numpy as np
import pytest
from shifted_functions import LOWER, UPPER, rosenbrock, sphere

from jffsr.compiling import Program
from jffsr.errors import InputError
from jffsr.optimizers import driver
from jffsr.optimizers.driver import Phase, Stop, blank_state, run
from jffsr.optimizers.interface import FunctionProblem
from jffsr.optimizers.qpso import QPSO
from jffsr.optimizers.registry import Settings, build_phases

PROBLEM = FunctionProblem(LOWER[:4], UPPER[:4], rosenbrock)
SETTINGS = Settings(
    particles=10, swarm_evaluations=70, starts=3, gradient_iterations=9, polish_iterations=7, memory=4
)
KEY = jax.random.key(8)


def hybrid(**keywords):
    return run(build_phases("hybrid", SETTINGS), PROBLEM, KEY, **keywords)


@pytest.fixture(scope="module")
def uninterrupted():
    """The outcome of a run in chunks of 3, and a snapshot after each."""
    snapshots = []
    return hybrid(chunk=3, on_chunk=snapshots.append), snapshots


def assert_same(one, other):
    assert one.history == other.history
    assert (one.best_value, one.reason) == (other.best_value, other.reason)
    assert (one.evaluations, one.gradient_evaluations) == (other.evaluations, other.gradient_evaluations)
    np.testing.assert_array_equal(one.best_position, other.best_position)
    jax.tree.map(np.testing.assert_array_equal, one.population, other.population)


def test_resume_from_any_snapshot_gives_the_same_bits(uninterrupted):
    outcome, snapshots = uninterrupted
    assert {snapshot.phase for snapshot in snapshots} == {0, 1, 2}
    assert len(snapshots) >= 9
    for snapshot in snapshots:
        assert_same(hybrid(chunk=3, resume=snapshot), outcome)


def test_resume_from_the_host_gives_the_same_bits(uninterrupted):
    """A snapshot that has been on disk comes back as NumPy arrays."""
    outcome, snapshots = uninterrupted
    for snapshot in snapshots[1::4]:
        state = jax.tree.map(
            lambda x: x if jax.dtypes.issubdtype(x.dtype, jax.dtypes.prng_key) else np.asarray(x),
            snapshot.state,
        )
        assert_same(hybrid(chunk=3, resume=replace(snapshot, state=state)), outcome)


def test_chunks_do_not_change_the_result(uninterrupted):
    assert_same(hybrid(chunk=1), uninterrupted[0])
    assert_same(hybrid(chunk=10), uninterrupted[0])


def test_interrupted_run_goes_on_where_it_stopped(uninterrupted):
    snapshots, asked = [], iter([False, False, False, True])
    stopped = hybrid(chunk=3, on_chunk=snapshots.append, interrupted=lambda: next(asked))
    assert stopped.interrupted
    assert stopped.history == snapshots[-1].history
    assert_same(hybrid(chunk=3, resume=snapshots[-1]), uninterrupted[0])


def test_blank_state_has_the_shapes_of_every_phase(uninterrupted):
    phases = build_phases("hybrid", SETTINGS)
    for snapshot in uninterrupted[1]:
        blank = blank_state(phases, snapshot.phase, PROBLEM, KEY)
        chex.assert_trees_all_equal_shapes_and_dtypes(blank, snapshot.state)


def test_history_counts_from_the_start_of_the_run(uninterrupted):
    outcome, _ = uninterrupted
    best = [record.best_value for record in outcome.history]
    assert all(b <= a for a, b in pairwise(best))
    for counts in zip(*((r.evaluations, r.gradient_evaluations) for r in outcome.history), strict=True):
        assert list(counts) == sorted(counts)
    last_of_swarm = [r for r in outcome.history if r.phase == 0][-1]
    assert (last_of_swarm.evaluations, last_of_swarm.gradient_evaluations) == (70, 0)
    assert outcome.evaluations == 70
    assert outcome.gradient_evaluations <= 3 * 16


def test_each_stopping_rule_ends_the_run():
    problem = FunctionProblem(LOWER[:4], UPPER[:4], sphere)
    swarm = QPSO(iterations=50.0, particles=10)
    cases = {"iterations": 7.0, "evaluations": 65.0, "target": 1.0}
    for rule, number in cases.items():
        outcome = run(
            [Phase("swarm", swarm, Stop(**{"iterations": 50.0, rule: number}))], problem, KEY, chunk=4
        )
        if rule == "target":
            assert outcome.reason == "target"
            assert outcome.history[-2].best_value > 1.0 >= outcome.best_value
        else:
            assert outcome.reason == "budget"
            assert outcome.evaluations == 70


def test_target_met_by_the_swarm_spares_the_gradients():
    settings = replace(SETTINGS, target=1e9)
    outcome = run(build_phases("hybrid", settings), PROBLEM, KEY, chunk=3)
    assert (outcome.reason, outcome.evaluations, outcome.gradient_evaluations) == ("target", 10, 0)


def test_no_phase_is_refused():
    with pytest.raises(InputError, match="no phase"):
        run([], PROBLEM, KEY)


def test_other_numbers_do_not_trace_again(monkeypatch):
    """Bounds, coefficients, budgets and seeds are traced: one trace for the swarm, one for both descents."""
    traced = chex.assert_max_traces(driver._advance, n=2)
    monkeypatch.setattr(driver, "_advance_jit", Program(traced, static_argnums=4))
    for k in range(3):
        problem = FunctionProblem(LOWER[:4] - k, UPPER[:4] + k, rosenbrock)
        settings = replace(
            SETTINGS,
            swarm_evaluations=70 + 10 * k,
            contraction=(1.0 + 0.1 * k, 0.5),
            gradient_iterations=9 + k,
        )
        run(build_phases("hybrid", settings), problem, jax.random.key(k), chunk=3)
