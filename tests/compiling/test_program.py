"""Programs: the same values as the function, one trace a form, compiled in threads or on the spot."""

from __future__ import annotations

import ctypes
import os
import threading
import weakref
from pathlib import Path

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.compiling import Program, forget, heap, room
from jffsr.compiling.program import is_waiting, seconds_waited


def scaled(tree, power):
    return {name: 2.0 * value**power for name, value in tree.items()}


def test_values_and_traces():
    program = Program(chex.assert_max_traces(scaled, n=3), static_argnums=1)
    for number in (1.0, 3.0):
        found = program({"a": np.full(3, number), "b": number}, 2)
        chex.assert_shape(found["a"], (3,))
        np.testing.assert_array_equal(found["a"], np.full(3, 2 * number**2))
        assert found["b"] == 2 * number**2
    np.testing.assert_array_equal(program({"a": np.ones(3), "b": 1.0}, 3)["a"], 2.0)
    assert program({"a": np.ones(2)}, 2)["a"].shape == (2,)
    with pytest.raises(AssertionError, match="assert_max_traces"):
        program({"a": np.ones(4)}, 2)


def test_prepared_for_shapes_it_is_traced_once():
    program = Program(chex.assert_max_traces(scaled, n=1), static_argnums=1)
    shapes = {"a": jax.ShapeDtypeStruct((3,), float)}
    future = program.prepare(shapes, 2)
    assert program.prepare(shapes, 2) is None
    np.testing.assert_array_equal(program({"a": np.ones(3)}, 2)["a"], 2.0)
    assert future.done()
    assert program.shape({"a": np.ones(3)}, 2)["a"].shape == (3,)


def test_waiting_is_counted_and_a_ready_program_adds_nothing():
    waiting = []
    program = Program(lambda x: waiting.append(is_waiting()) or x + 1)
    before = seconds_waited()
    program(1.0)
    first = seconds_waited()
    program(2.0)
    assert waiting == [True]
    assert seconds_waited() == first > before
    assert not is_waiting()


def test_a_thread_has_the_precision_that_was_asked_for():
    program = Program(lambda: jnp.zeros(1))
    with jax.enable_x64(False):
        program.prepare()
        assert program().dtype == np.float32
    assert program().dtype == np.float64


def test_what_fails_in_a_thread_is_told_to_the_caller_each_time():
    def broken(x):
        raise ZeroDivisionError("no such thing")

    program = Program(broken)
    program.prepare(1.0).exception()
    for _ in range(2):
        with pytest.raises(ZeroDivisionError, match="no such thing"):
            program(1.0)


def test_one_that_waits_its_turn_is_compiled_by_the_caller():
    """With every thread busy, or after the future was cancelled, nothing is waited for."""
    let_go, begun = threading.Event(), threading.Semaphore(0)

    def slow(x):
        begun.release()
        let_go.wait(60)
        return x

    busy = [Program(slow).prepare(np.zeros(size)) for size in (1, 2)]
    for _ in busy:
        assert begun.acquire(timeout=60)
    try:
        queued, cancelled = Program(jnp.sin), Program(jnp.cos)
        future = queued.prepare(0.0)
        assert cancelled.prepare(0.0).cancel()
        assert (queued(0.0), cancelled(0.0)) == (0.0, 1.0)
        assert future.cancelled()
    finally:
        let_go.set()
        for future in busy:
            future.result(60)


def test_traced_arguments_and_other_settings_are_left_to_jax():
    program = Program(lambda x: x**2)
    np.testing.assert_array_equal(jax.vmap(program)(np.arange(3.0)), [0.0, 1.0, 4.0])
    assert jax.grad(program)(3.0) == 6.0
    with jax.disable_jit():
        assert program(3.0) == 9.0
    with jax.debug_nans(True), pytest.raises(FloatingPointError), np.errstate(all="ignore"):
        Program(lambda x: x / x)(np.float64(0.0))


# What all other tests have compiled would go as well.
@pytest.mark.slow
def test_what_is_forgotten_is_compiled_anew():
    traces = []
    program = Program(lambda x: traces.append(None) or 2 * x)
    results = [program(np.float64(number)) for number in (1.0, 2.0)]
    assert len(traces) == 1
    executable = weakref.ref(next(iter(program._compiled.values())).result())
    forget()
    assert executable() is None
    results.append(program(np.float64(3.0)))
    assert len(traces) == 2
    np.testing.assert_array_equal(results, [2.0, 4.0, 6.0])


def test_freed_memory_goes_back_to_the_system():
    if not hasattr(ctypes.CDLL(None), "malloc_trim"):
        assert not heap.give_back()
        return

    def resident():
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    library = ctypes.CDLL(None)
    library.malloc.restype = ctypes.c_void_p
    pieces = [library.malloc(ctypes.c_size_t(10_000)) for _ in range(10_000)]
    for piece in pieces:
        ctypes.memset(piece, 1, 10_000)
    # The last one stays, and with it, for glibc alone, everything below.
    for piece in pieces[:-1]:
        library.free(ctypes.c_void_p(piece))
    kept = resident()
    assert heap.give_back()
    assert kept - resident() > 50e6
    library.free(ctypes.c_void_p(pieces[-1]))


def test_before_the_mappings_end_what_was_compiled_is_let_go_of(monkeypatch):
    first, second = Program(lambda x: 2 * x), Program(lambda x: 3 * x)
    first(np.float64(1.0))
    # What NumPy and the interpreter map leaves a share above zero.
    assert 0 < room.mappings_share() < room.MOST
    second(np.float64(1.0))
    assert first._compiled
    monkeypatch.setattr(room, "MOST", 0.0)
    assert second(np.ones(2)).tolist() == [3.0, 3.0]
    assert not first._compiled
    assert len(second._compiled) == 1
    assert first(np.float64(2.0)) == 4.0
