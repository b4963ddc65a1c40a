"""Single and double precision side by side in one process."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from experiments.benchmarks.cases import FLOAT64


@contextlib.contextmanager
def precision(name: str) -> Iterator[None]:
    """Within, JAX traces and calls programs in float64 or float32."""
    import jax

    with jax.enable_x64(name == FLOAT64):
        yield
