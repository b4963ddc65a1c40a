"""Functions compiled as wholes: ahead, beside other work, and, where a folder is kept, only once for all processes.

A `Program` does what `jax.jit` does, with three differences. `prepare` compiles it in a thread for arguments of
which only the shapes need be known, so that the main thread can compile or run something else meanwhile: XLA lets
other Python threads run. What was compiled is looked for in the folder of kept programs first, which also saves
tracing and lowering; JAX's own cache saves neither. And the time that a caller waited for it can be told apart
from running (`seconds_waited`).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial, update_wrapper
from typing import Any

import jax
import numpy as np

from jffsr.compiling import store
from jffsr.compiling.options import ONCE, OPTIONS

_WORKERS = 2
_workers = ThreadPoolExecutor(_WORKERS, thread_name_prefix="jffsr-compile")
_waited = threading.local()


def seconds_waited() -> float:
    """Seconds that this thread has waited for programs so far: tracing, compiling, loading, or a thread at it."""
    return getattr(_waited, "seconds", 0.0)


def is_waiting() -> bool:
    """Whether this thread is waiting for a program just now."""
    return getattr(_waited, "depth", 0) > 0


class Program:
    """A function of pytrees, compiled once for each structure, shape and type of its arguments.

    static_argnums are told apart by their values, as with `jax.jit`; once says that speed does not matter,
    because the program runs once where it runs at all, and compiles in half the time.
    """

    def __init__(
        self, function: Callable[..., Any], static_argnums: int | tuple[int, ...] = (), once: bool = False
    ):
        self._static = (static_argnums,) if isinstance(static_argnums, int) else tuple(static_argnums)
        self._options = ONCE if once else OPTIONS
        self._function = function
        self._jit = jax.jit(function, static_argnums=self._static, compiler_options=self._options)
        self._compiled: dict[Hashable, Future] = {}
        self._lock = threading.Lock()
        update_wrapper(self, function)

    def __call__(self, *args: Any) -> Any:
        """The function's value."""
        if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(args)):
            return self._function(*args)
        signature = self._signature(args)
        if signature is None:
            return self._jit(*args)
        executable = self._wait(signature, args)
        return executable(*(arg for i, arg in enumerate(args) if i not in self._static))

    def prepare(self, *args: Any) -> Future | None:
        """Begin to compile in a thread for arguments like these, of which jax.ShapeDtypeStruct is enough.

        The future may be cancelled by one who will not call the program; None where there is nothing to do.
        """
        signature = self._signature(args)
        if signature is None:
            return None
        with self._lock:
            known = self._compiled.get(signature)
            if known is not None and not known.cancelled():
                return None
            future = _workers.submit(self._obtain, args, bool(jax.config.jax_enable_x64))
            self._compiled[signature] = future
        return future

    def shape(self, *args: Any) -> Any:
        """Shapes and types of the value, traced at most once for arguments of the same form."""
        return self._jit.eval_shape(*args)

    def _wait(self, signature: Hashable, args: tuple[Any, ...]) -> Callable[..., Any]:
        with self._lock:
            future = self._compiled.get(signature)
            # One that no thread has begun is compiled here and now.
            own = future is None or (not future.done() and future.cancel()) or future.cancelled()
            if own:
                future = self._compiled[signature] = Future()
        if not own and future.done() and future.exception() is None:
            return future.result()
        start = time.perf_counter()
        _waited.depth = getattr(_waited, "depth", 0) + 1
        try:
            if own:
                try:
                    future.set_result(self._obtain(args, bool(jax.config.jax_enable_x64)))
                except BaseException as error:
                    future.set_exception(error)
            return future.result()
        except BaseException:
            with self._lock:
                self._compiled.pop(signature, None)
            raise
        finally:
            _waited.depth -= 1
            if not _waited.depth:
                _waited.seconds = seconds_waited() + time.perf_counter() - start

    def _obtain(self, args: tuple[Any, ...], x64: bool) -> Callable[..., Any]:
        # Whether floats have 64 bits is a matter of the thread.
        with jax.enable_x64(x64):
            dynamic = [arg for i, arg in enumerate(args) if i not in self._static]
            static = [args[i] for i in self._static]
            name = store.name_of(self._function, self._options, static, dynamic)
            if name is not None:
                kept = store.load(name)
                if kept is not None:
                    return kept
            lowered = self._jit.lower(*args)
            return lowered.compile() if name is None else store.compile_and_save(name, lowered, self._options)

    def _signature(self, args: tuple[Any, ...]) -> Hashable | None:
        """What the compiled form depends on; None where `jax.jit` has to do it (debugging, other devices)."""
        if jax.config.jax_disable_jit or jax.config.jax_debug_nans or jax.config.jax_debug_infs:
            return None
        if jax.config.jax_default_device is not None:
            return None
        dynamic = tuple(arg for i, arg in enumerate(args) if i not in self._static)
        leaves, structure = jax.tree.flatten(dynamic)
        if not all(map(_is_plain, leaves)):
            return None
        types = tuple(map(_type, leaves))
        static = tuple(args[i] for i in self._static)
        return structure, types, static, bool(jax.config.jax_enable_x64)


def program(static_argnums: int | tuple[int, ...] = (), once: bool = False) -> Callable[..., Program]:
    """Decorator that makes a function a Program."""
    return partial(Program, static_argnums=static_argnums, once=once)


def _is_plain(leaf: Any) -> bool:
    """Whether a leaf is a value, or the shape of one, on the default device alone."""
    if not isinstance(leaf, jax.Array):
        return True
    return leaf.sharding.device_set == {jax.local_devices()[0]}


def _type(leaf: Any) -> tuple[tuple[int, ...], Any, bool]:
    if isinstance(leaf, np.ndarray):
        return leaf.shape, leaf.dtype, False
    kind = jax.typeof(leaf)
    return kind.shape, kind.dtype, getattr(kind, "weak_type", False)
