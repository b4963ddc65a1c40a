"""The mesh of devices that batches are spread over. It is JAX's own mesh context, which its caches know of."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import jax
import numpy as np
from jax.sharding import AxisType, Mesh, NamedSharding, PartitionSpec

from jffsr.errors import InputError

AXIS = "batch"


@contextmanager
def all_devices() -> Iterator[None]:
    """Context in which batches are spread over the devices of the mesh in use, else over all of all processes.

    Nothing changes within a transformation of JAX, and where there is one device.
    """
    mesh = _mesh()
    if mesh is None or transforming():
        yield
        return
    with jax.set_mesh(mesh):
        yield


def _mesh() -> Mesh | None:
    """The mesh to enter; None where the one in use will do."""
    in_use = jax.sharding.get_abstract_mesh()
    if in_use.empty:
        return None if jax.device_count() == 1 else _automatic(np.array(jax.devices()), (AXIS,))
    if AxisType.Explicit in in_use.axis_types:
        mesh = jax.sharding.get_mesh()
        return _automatic(mesh.devices, mesh.axis_names)
    return None


def _automatic(devices: np.ndarray, names: tuple[str, ...]) -> Mesh:
    return Mesh(devices, names, axis_types=(AxisType.Auto,) * devices.ndim)


def transforming() -> bool:
    """Whether this is called within a transformation of JAX, such as `jax.jit` or `jax.grad`."""
    try:
        with jax.set_mesh(_automatic(np.array(jax.local_devices()[:1]), (AXIS,))):
            return False
    except ValueError:
        # There is no public question, but a mesh can be set only outside.
        return True


def free_axes() -> tuple[str, ...]:
    """Names of the axes of the mesh in use that a batch may be spread over: none within a spread batch."""
    mesh = jax.sharding.get_abstract_mesh()
    if mesh.empty or AxisType.Manual in mesh.axis_types:
        return ()
    if AxisType.Explicit in mesh.axis_types:
        raise InputError(
            "a batch is spread over automatic axes: make the mesh with axis_types=(AxisType.Auto,)"
        )
    return mesh.axis_names


def count_devices(axes: tuple[str, ...]) -> int:
    """The number of devices along these axes of the mesh in use."""
    shape = jax.sharding.get_abstract_mesh().shape
    return int(np.prod([shape[axis] for axis in axes], dtype=int))


def on_all_devices(tree: Any) -> Any:
    """The arrays with a copy on every device of the mesh in use, as compiled programs give them back."""
    mesh = jax.sharding.get_mesh()
    if mesh.empty:
        return tree
    # A compiled copy, because `jax.device_put` reaches no device of another process.
    return jax.jit(lambda whole: whole, out_shardings=NamedSharding(mesh, PartitionSpec()))(tree)
