"""The finished part of a batch of plans on disk, from which the same call goes on."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.parallel.processes import first_does, is_first
from jffsr.writing import write_atomically

_FORMAT = 1


def save_plans(path: Path, mark: str, plans: Any) -> None:
    """Write a pytree of host arrays atomically, under the mark of the problems that it answers; one process does."""
    if not is_first():
        return
    leaves = jax.tree.leaves(plans)
    head = json.dumps({"format": _FORMAT, "mark": mark, "leaves": len(leaves)}).encode()
    arrays = {f"leaf{i}": np.asarray(leaf) for i, leaf in enumerate(leaves)}

    def write(part: Path) -> None:
        with open(part, "wb") as file:
            np.savez(file, head=np.frombuffer(head, dtype=np.uint8), **arrays)

    try:
        write_atomically(path, write)
    except OSError as error:
        raise InputError(f"{path}: the checkpoint cannot be written ({error.strerror or error})") from None


def load_plans(path: Path, mark: str, blank: Any) -> Any | None:
    """The pytree as it was saved, in the structure of `blank`; None where there is no file.

    Raises InputError where the file is damaged or of other problems.
    """
    data = first_does(lambda: _read(path))
    if not data:
        return None
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            head = json.loads(file["head"].tobytes())
            leaves = [file[f"leaf{i}"] for i in range(head["leaves"])]
    except Exception as error:
        raise InputError(
            f"{path}: the checkpoint cannot be read ({error}); delete it to start again"
        ) from None
    shapes, structure = jax.tree.flatten(blank)
    same = head.get("format") == _FORMAT and head.get("mark") == mark and len(leaves) == len(shapes)
    if not same or any(leaf.shape[1:] != blank.shape[1:] for leaf, blank in zip(leaves, shapes, strict=True)):
        raise InputError(f"{path}: the checkpoint is of other problems; give another file or delete it")
    return structure.unflatten(leaves)


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return b""
    except OSError as error:
        raise InputError(f"{path}: the checkpoint cannot be read ({error.strerror or error})") from None
