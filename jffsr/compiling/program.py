"""Functions compiled as wholes: ahead, beside other work, and, where a folder is kept, only once for all processes.

A `Program` does what `jax.jit` does, with four differences. `prepare` compiles it in a thread for arguments of
which only the shapes need be known, so that the main thread can compile or run something else meanwhile: XLA lets
other Python threads run. What was compiled is looked for in the folder of kept programs first, which also saves
tracing and lowering; JAX's own cache saves neither. The time that a caller waited for it can be told apart
from running (`seconds_waited`). And within a mesh of devices every argument goes to each of them.
"""

from __future__ import annotations

import gc
import threading
import time
import weakref
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import nullcontext
from functools import partial, update_wrapper, wraps
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from jffsr.compiling import heap, room, store
from jffsr.compiling.options import ONCE, OPTIONS

_WORKERS = 2
_workers = ThreadPoolExecutor(_WORKERS, thread_name_prefix="jffsr-compile")
_waited = threading.local()
_all: weakref.WeakSet[Program] = weakref.WeakSet()


def seconds_waited() -> float:
    """Seconds that this thread has waited for programs so far: tracing, compiling, loading, or a thread at it."""
    return getattr(_waited, "seconds", 0.0)


def is_waiting() -> bool:
    """Whether this thread is waiting for a program just now."""
    return getattr(_waited, "depth", 0) > 0


def forget() -> None:
    """Let go of every compiled program, JAX's own too, and of their memory: what is called next compiles anew.

    A process that has gone through many different problems holds the programs of all of them: gigabytes after some
    hundred, and more mappings than the system allows (`jffsr.compiling.room`), before which this is done of itself.
    Programs that a thread is compiling just now stay.
    """
    for known in list(_all):
        known.forget()
    jax.clear_caches()
    gc.collect()
    heap.give_back()


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
        self._jit = jax.jit(_whole(function), static_argnums=self._static, compiler_options=self._options)
        self._compiled: dict[Hashable, Future] = {}
        self._lock = threading.Lock()
        update_wrapper(self, function)
        _all.add(self)

    def __call__(self, *args: Any) -> Any:
        """The function's value."""
        if any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(args)):
            return self._function(*args)
        signature = self._signature(args)
        if signature is None:
            return self._jit(*args)
        executable = self._wait(signature, args)
        dynamic = [arg for i, arg in enumerate(args) if i not in self._static]
        everywhere = _everywhere()
        return executable(*(dynamic if everywhere is None else jax.device_put(dynamic, everywhere)))

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
            future = _workers.submit(self._obtain_as, args, bool(jax.config.jax_enable_x64), _mesh())
            self._compiled[signature] = future
        return future

    def forget(self) -> None:
        """Let go of what has been compiled."""
        with self._lock:
            self._compiled = {key: future for key, future in self._compiled.items() if not future.done()}

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
                    future.set_result(self._obtain(args))
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

    def _obtain_as(self, args: tuple[Any, ...], x64: bool, mesh: Mesh) -> Callable[..., Any]:
        # Whether floats have 64 bits, and the mesh, are matters of the thread.
        with jax.enable_x64(x64), nullcontext() if mesh.empty else jax.set_mesh(mesh):
            return self._obtain(args)

    def _obtain(self, args: tuple[Any, ...]) -> Callable[..., Any]:
        everywhere = _everywhere()
        dynamic = [arg for i, arg in enumerate(args) if i not in self._static]
        static = [args[i] for i in self._static]
        # In other threads something may be traced just now, whose caches this would empty.
        if threading.current_thread() is threading.main_thread() and room.has_little_room():
            forget()
        name = store.name_of(self._function, self._options, static, dynamic, _mesh())
        if name is not None:
            kept = store.load(name, _mesh())
            if kept is not None:
                return kept
        if everywhere is not None:
            args = tuple(
                arg if i in self._static else jax.tree.map(partial(_shape, everywhere), arg)
                for i, arg in enumerate(args)
            )
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
        mesh = _mesh()
        homes = {jax.local_devices()[0]} if mesh.empty else set(mesh.devices.flat)
        if not homes <= set(jax.local_devices()) or not all(_is_plain(leaf, homes) for leaf in leaves):
            return None
        types = tuple(map(_type, leaves))
        static = tuple(args[i] for i in self._static)
        return structure, types, static, bool(jax.config.jax_enable_x64), mesh


def program(static_argnums: int | tuple[int, ...] = (), once: bool = False) -> Callable[..., Program]:
    """Decorator that makes a function a Program."""
    return partial(Program, static_argnums=static_argnums, once=once)


def _mesh() -> Mesh:
    """The mesh in use; an empty one where there is none."""
    return jax.sharding.get_mesh()


def _everywhere() -> NamedSharding | None:
    """A copy on every device of the mesh in use; None where there is no mesh."""
    mesh = _mesh()
    return None if mesh.empty else NamedSharding(mesh, PartitionSpec())


def _whole(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, every device of a mesh getting all of the results, however they were come by."""

    @wraps(function)
    def whole(*args: Any) -> Any:
        found = function(*args)
        if jax.sharding.get_abstract_mesh().empty:
            return found
        return jax.lax.with_sharding_constraint(found, PartitionSpec())

    return whole


def _shape(everywhere: NamedSharding, leaf: Any) -> jax.ShapeDtypeStruct:
    kind = jax.typeof(leaf)
    weak = getattr(kind, "weak_type", False)
    return jax.ShapeDtypeStruct(kind.shape, kind.dtype, sharding=everywhere, weak_type=weak)


def _is_plain(leaf: Any, homes: set[jax.Device]) -> bool:
    """Whether a leaf is a value, or the shape of one, that is to be had from these devices."""
    if not isinstance(leaf, jax.Array):
        return True
    return leaf.sharding.device_set <= homes | {jax.local_devices()[0]}


def _type(leaf: Any) -> tuple[tuple[int, ...], Any, bool]:
    if isinstance(leaf, np.ndarray):
        return leaf.shape, leaf.dtype, False
    kind = jax.typeof(leaf)
    return kind.shape, kind.dtype, getattr(kind, "weak_type", False)
