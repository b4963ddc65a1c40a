"""A direction of the tool, and a motion of the joints, in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# A component below this share of the largest goes unsaid.
_SAID = 0.3

_MOTIONS = tuple(f"{verb} {axis}" for verb in ("moving along", "turning about") for axis in "xyz")


def direction_in_words(direction: np.ndarray, whose: str = "the tool's") -> str:
    """A unit twist (6,) as its larger components, the largest first: `turning about the tool's y, 0.98`."""
    direction = _upright(direction)
    parts = []
    for index in _largest(direction):
        motion, axis = _MOTIONS[index].rsplit(" ", 1)
        parts.append(f"{motion} {whose} {axis}, {direction[index]:.2f}")
    return "; ".join(parts)


def joints_in_words(motion: np.ndarray, names: Sequence[str]) -> str:
    """A unit joint motion (n,) as its larger components: `joint4 +0.71, joint6 -0.71`."""
    motion = _upright(motion)
    return ", ".join(f"{names[index]} {motion[index]:+.2f}" for index in _largest(motion))


def _largest(vector: np.ndarray) -> np.ndarray:
    order = np.argsort(-np.abs(vector), kind="stable")
    return order[np.abs(vector[order]) >= _SAID * np.abs(vector).max()]


def _upright(vector: np.ndarray) -> np.ndarray:
    """The vector or its opposite, which says the same, with its largest component positive."""
    return vector if vector[np.argmax(np.abs(vector))] > 0 else -vector
