"""Names of compiled programs: a digest of everything that could make one differ from another.

That is the package's own text, the versions of what it is built on, the processor, JAX's settings, the function,
and the structure, shapes and types of its arguments with everything static in them.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import platform
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FunctionType
from typing import Any

import jax
import numpy as np
from jax.sharding import Mesh

import jffsr

# Types and functions of these are told by their names: the package's text and the versions stand in the digest.
_TRUSTED = ("jffsr", "jax", "jaxlib", "numpy", "optax", "chex", "evosax", "builtins")


class Unnamed(Exception):
    """Something has no name that would stay the same in another process and change with its meaning."""


def digest(function: Callable, options: dict, static: list[Any], dynamic: list[Any], mesh: Mesh) -> str:
    """The name of a program, hexadecimal; Unnamed where it depends on what cannot be told by name."""
    leaves, structure = jax.tree.flatten(dynamic)
    types, values = [jax.typeof(leaf) for leaf in leaves], jax.config.values
    parts = [
        _function(function),
        str(options),
        "" if mesh.empty else f"{mesh.shape} {mesh.axis_types} {[device.id for device in mesh.devices.flat]}",
        *_surroundings(),
        # Where compiled programs are kept does not change them; attributes also see what a thread has set.
        *(
            f"{name}={getattr(jax.config, name, values[name])!r}"
            for name in sorted(values)
            if "cache" not in name
        ),
        *(_value(item) for item in static),
        *_structure(structure),
        *(f"{kind.shape} {kind.dtype} {getattr(kind, 'weak_type', False)}" for kind in types),
    ]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


@cache
def _surroundings() -> tuple[str, ...]:
    versions = [f"{name} {_version(name)}" for name in _TRUSTED if name not in ("jffsr", "builtins")]
    devices = [f"{device.platform} {device.device_kind} {device.id}" for device in jax.devices()]
    return (
        _own_text(),
        *versions,
        f"python {sys.version}",
        f"{platform.platform()} {_processor()}",
        *devices,
        *(f"{name}={os.environ.get(name)}" for name in ("XLA_FLAGS", "LIBTPU_INIT_ARGS")),
    )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _own_text() -> str:
    """A digest of the package's source."""
    root = Path(jffsr.__file__).parent
    whole = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        whole.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes() + b"\0")
    return whole.hexdigest()


def _processor() -> str:
    """What the processor can do: code made for one may stop another."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    kinds = ("model name", "flags", "Features", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(kinds)}))


def _structure(tree: Any) -> Iterator[str]:
    """A line for each node of a pytree's structure: its type, its static data, and how many children."""
    node = tree.node_data()
    if node is None:
        yield f"leaf {tree.num_leaves}"
        return
    kind, data = node
    children = tree.children()
    yield f"{_type(kind)} {_value(data)} {len(children)}"
    for child in children:
        yield from _structure(child)


def _value(value: Any) -> str:
    """A static value as text."""
    if value is None or isinstance(value, str | bytes | bool | int | float | complex | np.generic):
        return f"{type(value).__name__} {value!r}"
    if isinstance(value, tuple | list):
        return f"{_type(type(value))}({', '.join(map(_value, value))})"
    if isinstance(value, dict):
        return f"dict({', '.join(f'{_value(k)}: {_value(v)}' for k, v in value.items())})"
    if isinstance(value, np.ndarray) and value.dtype != object:
        return f"array {value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    if isinstance(value, type):
        return _type(value)
    if isinstance(value, FunctionType):
        return _function(value)
    if dataclasses.is_dataclass(value):
        fields = (f"{f.name}={_value(getattr(value, f.name))}" for f in dataclasses.fields(value))
        return f"{_type(type(value))}({', '.join(fields)})"
    raise Unnamed(f"{type(value).__name__} {value!r}")


def _type(kind: type) -> str:
    if kind.__module__.partition(".")[0] not in _TRUSTED:
        raise Unnamed(f"type {kind.__module__}.{kind.__qualname__}")
    return f"{kind.__module__}.{kind.__qualname__}"


def _function(function: Callable) -> str:
    name = f"{function.__module__}.{function.__qualname__}"
    if function.__module__.partition(".")[0] not in _TRUSTED or getattr(function, "__closure__", None):
        raise Unnamed(f"function {name}")
    return name
