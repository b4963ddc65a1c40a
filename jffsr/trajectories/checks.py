"""What the joint laws refuse before a number of theirs is traced: wrong sizes, durations, boxes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jffsr.errors import InputError


def joint_vectors(**given: Sequence[float] | float | None) -> dict[str, np.ndarray]:
    """The joint quantities as float vectors (n,), n being the size of the first; None gives zeros, a number all alike.

    Raises InputError where sizes differ or a number is NaN; underscores in a name are read as spaces.
    """
    (first, reference), *_ = given.items()
    size = np.size(reference)
    result = {}
    for name, value in given.items():
        vector = np.array(0.0 if value is None else value, dtype=float)
        if vector.ndim == 0 and (value is None or name != first):
            vector = np.full(size, float(vector))
        what = name.replace("_", " ")
        if vector.ndim != 1:
            raise InputError(f"{what} has the shape {vector.shape}; one number for each joint is expected")
        if vector.size != size:
            raise InputError(f"{what} has {vector.size} numbers; {first} has {size}")
        if np.any(np.isnan(vector)):
            raise InputError(f"{what} is {vector.tolist()}; numbers are expected")
        result[name] = vector
    return result


def checked_duration(duration: float) -> np.ndarray:
    """The duration, s, if it is positive and finite."""
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"duration is {duration:g} s; it must be positive and finite")
    return np.array(duration, dtype=float)


def checked_duration_bounds(bounds: tuple[float, float] | None) -> np.ndarray | None:
    """Bounds (2,), s, of a free duration, if they are positive, finite and in order; None for a fixed one."""
    if bounds is None:
        return None
    shortest, longest = bounds
    if not 0 < shortest < longest < np.inf:
        raise InputError(
            f"duration bounds are [{shortest:g}, {longest:g}] s; they must be positive, finite and in order"
        )
    return np.array(bounds, dtype=float)


def checked_box(box: float) -> np.ndarray:
    """The half width of the box of the free numbers, if it is positive and finite."""
    if not 0 < box < np.inf:
        raise InputError(f"box is {box:g}; it must be positive and finite")
    return np.array(box, dtype=float)


def checked_size(value: int, least: int, what: str) -> int:
    """A whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise InputError(f"{what} is {value!r}; a whole number of at least {least} is expected")
    return int(value)
