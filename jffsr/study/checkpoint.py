"""A search's snapshot on disk, from which the same command goes on to the same bits."""

from __future__ import annotations

import io
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.errors import InputError
from jffsr.optimizers.driver import Phase, Record, Snapshot, blank_state
from jffsr.optimizers.interface import OptimizationProblem
from jffsr.parallel.processes import first_does, is_first
from jffsr.types import Array
from jffsr.writing import write_atomically

_FORMAT = 1


def save_checkpoint(path: Path, snapshot: Snapshot) -> None:
    """Write the snapshot atomically; of several processes the first does, but all have to call it."""
    leaves = [_to_numpy(leaf) for leaf in jax.tree.leaves(snapshot.state)]
    if not is_first():
        return
    head = {"format": _FORMAT, "phase": snapshot.phase, "leaves": len(leaves)}

    def write(part: Path) -> None:
        with open(part, "wb") as file:
            np.savez(
                file,
                head=np.frombuffer(json.dumps(head).encode(), dtype=np.uint8),
                history=np.array(snapshot.history, dtype=float).reshape(-1, len(Record._fields)),
                **{f"leaf{i}": leaf for i, leaf in enumerate(leaves)},
            )

    write_atomically(path, write)


def load_checkpoint(path: Path, phases: list[Phase], problem: OptimizationProblem, key: Array) -> Snapshot:
    """Read a snapshot of these phases; InputError where the file is damaged or of another search."""
    try:
        with np.load(io.BytesIO(first_does(path.read_bytes)), allow_pickle=False) as file:
            head = json.loads(file["head"].tobytes())
            history = file["history"]
            leaves = [file[f"leaf{i}"] for i in range(head["leaves"])]
    except Exception as error:
        raise InputError(
            f"{path}: the checkpoint cannot be read ({error}); delete it to start again"
        ) from None
    if head.get("format") != _FORMAT or not 0 <= head["phase"] < len(phases):
        raise InputError(f"{path}: the checkpoint is of another version; delete it to start again")
    shapes, structure = jax.tree.flatten(blank_state(phases, head["phase"], problem, key))
    if len(shapes) != len(leaves):
        raise InputError(f"{path}: the checkpoint is of another search; delete it to start again")
    state = structure.unflatten(
        [_from_numpy(leaf, shape) for leaf, shape in zip(leaves, shapes, strict=True)]
    )
    records = tuple(Record(int(p), int(i), int(e), int(g), float(b)) for p, i, e, g, b in history)
    return Snapshot(head["phase"], state, records)


def _is_key(leaf) -> bool:
    return jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)


def _to_numpy(leaf) -> np.ndarray:
    return np.asarray(jax.random.key_data(leaf) if _is_key(leaf) else leaf)


def _from_numpy(leaf: np.ndarray, shape) -> Array:
    return jax.random.wrap_key_data(jnp.asarray(leaf)) if _is_key(shape) else jnp.asarray(leaf)
