"""Registering dataclasses as pytrees whose structures differ where the classes do.

JAX's own `register_dataclass` (jaxlib 0.10.2 and 0.12.0.1 at least) makes structures of different classes compare equal
where the number of their numbers and their static fields are equal. Their hashes differ, which mostly keeps them
apart: but a table that looks at a part of the hash first, as that behind `jax.jit` does, at times finds the program
of the other class, and runs it: in one run of the tests a quintic timing moved at a constant rate.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any, TypeVar

import jax

T = TypeVar("T", bound=type)


def register_dataclass(cls: T) -> T:
    """Register a dataclass as a pytree, in place of `jax.tree_util.register_dataclass`; a decorator.

    Fields with metadata={"static": True} are part of the structure, all others are children under their names. Fields
    that the constructor does not take are left out.
    """
    fields = [field for field in dataclasses.fields(cls) if field.init]
    static = tuple(field.name for field in fields if field.metadata.get("static", False))
    data = tuple(field.name for field in fields if field.name not in static)
    keys = tuple(map(jax.tree_util.GetAttrKey, data))

    def flatten(node: Any) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
        return tuple(getattr(node, name) for name in data), tuple(getattr(node, name) for name in static)

    def flatten_with_keys(node: Any) -> tuple[tuple[tuple[Any, Any], ...], tuple[Any, ...]]:
        children, rest = flatten(node)
        return tuple(zip(keys, children, strict=True)), rest

    def unflatten(rest: tuple[Any, ...], children: Iterable[Any]) -> Any:
        return cls(**dict(zip(data, children, strict=True)), **dict(zip(static, rest, strict=True)))

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls
