"""The benchmark's clockwork: what is timed is the work and not its dispatch, in turn, after a warm-up."""

from __future__ import annotations

import jax
import numpy as np

from experiments.benchmarks.opponents.program import Program, called, compiled
from experiments.benchmarks.timing import SHORTEST, timed


class Clock:
    """A clock that programs move."""

    def __init__(self):
        self.now, self.log = 0.0, []

    def __call__(self):
        return self.now

    def program(self, name, seconds):
        def run():
            self.now += seconds
            self.log.append(name)

        return Program(run, 0.0)


def test_programs_take_turns_after_one_call_that_is_not_counted():
    clock = Clock()
    found = timed({"a": clock.program("a", 0.5), "b": clock.program("b", 0.25)}, 3, clock=clock)
    # One call to warm up and one to size the samples, then in turn.
    assert "".join(clock.log) == "aabb" + "ab" * 3
    assert found["a"].samples == (0.5,) * 3
    assert (found["b"].median, found["b"].best) == (0.25, 0.25)


def test_short_programs_are_called_often_enough_for_the_clock():
    clock = Clock()
    found = timed({"a": clock.program("a", SHORTEST / 10)}, 3, clock=clock)
    assert len(clock.log) in (2 + 3 * 9, 2 + 3 * 10)
    np.testing.assert_allclose(found["a"].samples, SHORTEST / 10)


def test_long_programs_are_repeated_three_times_and_no_more():
    clock = Clock()
    found = timed({"slow": clock.program("s", 9.0), "fast": clock.program("f", 0.1)}, 6, clock=clock)
    assert len(found["slow"].samples) == 3
    assert len(found["fast"].samples) == 6


def test_a_program_returns_only_when_its_result_is_there(monkeypatch):
    waited, wait = [], jax.block_until_ready
    monkeypatch.setattr(jax, "block_until_ready", lambda x: waited.append(x) or wait(x))
    for make in (compiled, called):
        program = make(lambda x: 2 * x, np.arange(3.0))
        waited.clear()
        result = program.run()
        assert len(waited) == 1
        assert waited[0] is result
        np.testing.assert_array_equal(result, [0, 2, 4])
        assert program.compile_seconds >= 0


def test_single_precision_is_single_inside_a_process_of_double_precision():
    program = compiled(lambda x: x + 1, np.zeros(2, np.float32), precision_name="float32")
    assert program.run().dtype == np.float32
    assert jax.config.jax_enable_x64
