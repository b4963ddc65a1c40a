"""A function of one candidate over a batch: spread over the devices of the mesh in use, on each of them in chunks.

The function is traced once, for one candidate; that trace tells how much memory a candidate needs and is what is
vectorized. Batches that do not divide evenly are padded with their last candidate, and the results cut.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextvars import ContextVar
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import jaxpr_as_fun
from jax.sharding import PartitionSpec

from jffsr.compiling import jit
from jffsr.errors import InputError
from jffsr.parallel.chunks import LANES, chunk_size
from jffsr.parallel.devices import all_devices, count_devices, free_axes, transforming
from jffsr.parallel.footprint import live_bytes


def map_batch(
    function: Callable[[Any], Any], batch: Any, *, chunk: int | None = None, memory: int | None = None
) -> Any:
    """The results of a function of one candidate for every candidate of a batch, in bounded memory on all devices.

    batch is a pytree with a leading axis (K, ...) on every array; so is the result. The function is vectorized over
    `chunk` candidates at a time on each device; without it the chunk follows from `memory`, a limit in bytes on what
    one device holds beside the batch and the results (by default 2 MiB, and at least 8 candidates, on a CPU, which is
    fastest, and a share of the memory of other devices). The devices are those of the mesh in use (`jax.set_mesh`),
    else all. The function is compiled once for each function object and each shape; differentiate it inside, not
    outside: `map_batch(jax.grad(f), batch)`. Raises InputError for a batch without a common leading axis, or a chunk
    or memory that is not positive.
    """
    _check(batch, chunk, memory)
    if transforming():
        # A compiled function with options of its own may not stand within another.
        return spread(function, batch, chunk=chunk, memory=memory)
    try:
        hash(function)
    except TypeError:
        function = partial(function)
    with all_devices():
        return _spread_jit(function, batch, chunk, memory)


def evaluate(function: Callable[[Any], Any], batch: Any) -> Any:
    """The same inside a compiled program, every device getting all of the results (K, ...), which should be small.

    One candidate, and a batch within a function that is itself spread over a batch, are only vectorized.
    """
    if _within.get() or batch_size(batch) == 1:
        return jax.vmap(function)(batch)
    return spread(function, batch, together=True)


def spread(
    function: Callable[[Any], Any],
    batch: Any,
    *,
    chunk: int | None = None,
    memory: int | None = None,
    together: bool = False,
) -> Any:
    """`map_batch` without checks, to be compiled by the caller; `together` leaves the results on every device."""
    count = batch_size(batch)
    axes = free_axes()
    devices = count_devices(axes)
    if count == 0 or devices == 1:
        return _in_chunks(function, batch, chunk, memory)
    each = math.ceil(count / devices)

    batch = _padded(batch, each * devices)
    if together:
        # The batch comes in whole, else the compiler might keep what it was made from in parts.
        sharded = _on_each(partial(_own_share, function, chunk, memory, each, axes), PartitionSpec())
    else:
        sharded = _on_each(lambda part: _in_chunks(function, part, chunk, memory), PartitionSpec(axes))
    return _cut(sharded(batch), count)


def _on_each(function: Callable[[Any], Any], layout: PartitionSpec) -> Callable[[Any], Any]:
    return jax.shard_map(function, in_specs=layout, out_specs=layout, check_vma=False)


def _own_share(function, chunk, memory, each: int, axes: tuple[str, ...], batch: Any) -> Any:
    """All results, of which this device makes the `each` that are its own."""
    start = each * jax.lax.axis_index(axes)
    part = jax.tree.map(lambda x: jax.lax.dynamic_slice_in_dim(x, start, each), batch)
    results = _in_chunks(function, part, chunk, memory)
    return jax.tree.map(lambda x: jax.lax.all_gather(x, axes, tiled=True), results)


_within: ContextVar[bool] = ContextVar("within a spread function", default=False)


def _marked(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The function, knowing while it is traced that it is spread."""

    def marked(item: Any) -> Any:
        token = _within.set(True)
        try:
            return function(item)
        finally:
            _within.reset(token)

    return marked


_spread_jit = jit(lambda f, b, c, m: spread(f, b, chunk=c, memory=m), static_argnums=(0, 2, 3))


def _in_chunks(function: Callable[[Any], Any], batch: Any, chunk: int | None, memory: int | None) -> Any:
    """The function over a batch on one device."""
    count, function = batch_size(batch), _marked(function)
    if chunk is None and memory is None and count <= LANES:
        return jax.vmap(function)(batch)
    if chunk is not None and chunk >= count:
        return jax.vmap(function)(batch)
    one = jax.tree.map(lambda x: jax.ShapeDtypeStruct(x.shape[1:], x.dtype), batch)
    closed, result = jax.make_jaxpr(function, return_shape=True)(one)
    structure = jax.tree.structure(result)

    def traced(item: Any) -> Any:
        return structure.unflatten(jaxpr_as_fun(closed)(*jax.tree.leaves(item)))

    if chunk is None:
        chunk = chunk_size(count, live_bytes(closed.jaxpr), memory)
    if chunk >= count:
        return jax.vmap(traced)(batch)
    loops = math.ceil(count / chunk)
    chunks = jax.tree.map(lambda x: x.reshape((loops, chunk, *x.shape[1:])), _padded(batch, loops * chunk))
    results = jax.lax.map(jax.vmap(traced), chunks)
    return _cut(jax.tree.map(lambda x: x.reshape((loops * chunk, *x.shape[2:])), results), count)


def batch_size(batch: Any) -> int:
    """K of a pytree with a leading axis (K, ...) on every array."""
    return jax.tree.leaves(batch)[0].shape[0]


def _padded(batch: Any, length: int) -> Any:
    """The batch with its last candidate repeated to this length."""
    missing = length - batch_size(batch)
    if missing == 0:
        return batch
    return jax.tree.map(
        lambda x: jnp.concatenate([x, jnp.broadcast_to(x[-1:], (missing, *x.shape[1:]))]), batch
    )


def _cut(results: Any, count: int) -> Any:
    return results if batch_size(results) == count else jax.tree.map(lambda x: x[:count], results)


def _check(batch: Any, chunk: int | None, memory: int | None) -> None:
    shapes = [np.shape(leaf) for leaf in jax.tree.leaves(batch)]
    if not shapes or any(not shape or shape[0] != shapes[0][0] for shape in shapes):
        raise InputError(
            f"the batch has arrays of shapes {', '.join(map(str, shapes)) or 'none'}; one leading axis of the same "
            f"length is expected on every array"
        )
    for name, value in (("chunk", chunk), ("memory", memory)):
        if value is not None and not value >= 1:
            raise InputError(f"{name} is {value}; a positive number is expected")
