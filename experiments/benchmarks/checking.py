"""Whether the opponents compute the same thing, before any of them is timed."""

from __future__ import annotations

import numpy as np

from experiments.benchmarks.cases import tolerance


def difference(result, reference) -> float:
    """Largest difference of a component over the rows that both have; of quaternions, q and -q are the same.

    Of a pair (values, gradients) both count, relative to the largest component of the reference.
    """
    if isinstance(result, tuple | list):
        return max(_relative(a, b) for a, b in zip(result, reference, strict=True))
    a, b = _rows(result, reference)
    if a.shape[-1] == 4:
        a = a * np.sign(np.sum(a * b, axis=-1, keepdims=True))
    return float(np.max(np.abs(a - b)))


def agrees(found: float, precision: str, steps: int) -> bool:
    """Whether a difference is within the tolerance; what is not a number is not."""
    return found <= tolerance(precision, steps)


def _relative(result, reference) -> float:
    a, b = _rows(result, reference)
    return float(np.max(np.abs(a - b)) / max(1e-300, float(np.max(np.abs(b)))))


def _rows(result, reference):
    a, b = (np.asarray(x, dtype=float) for x in (result, reference))
    count = min(len(a), len(b))
    return a[:count], b[:count]
