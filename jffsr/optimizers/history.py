"""The history of a search, in bounded memory: whole while it is short, then only what bettered the value.

What is dropped depends on the records alone, not on how they came in chunks, so that a resumed search has the
history of an uninterrupted one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

LIMIT = 4096
"""More records than this are thinned."""


class Record(NamedTuple):
    """One iteration of the history; evaluations are counted from the start of the run."""

    phase: int
    iteration: int
    evaluations: int
    gradient_evaluations: int
    best_value: float


def add(history: list[Record], record: Record) -> None:
    """Append a record, and thin the history where it has grown too long."""
    history.append(record)
    if len(history) > LIMIT:
        history[:] = _thinned(history)


def _thinned(history: list[Record]) -> list[Record]:
    """The first and last of each phase and all that bettered the value; of too many of these, one in every `stride`
    iterations, which doubles until they are few."""
    kept = [record for i, record in enumerate(history) if _ends_phase(history, i) or _betters(history, i)]
    stride, ordinals = 1, _ordinals(kept)
    while len({ordinal // stride for ordinal in ordinals}) > LIMIT // 2:
        stride *= 2
    return [
        record
        for i, record in enumerate(kept)
        if _ends_phase(kept, i) or ordinals[i] // stride != ordinals[i - 1] // stride
    ]


def _ordinals(history: Sequence[Record]) -> list[int]:
    """How many iterations of all phases were done at each record."""
    found, done = [], 0
    for i, record in enumerate(history):
        if i and record.phase != history[i - 1].phase:
            done += history[i - 1].iteration
        found.append(done + record.iteration)
    return found


def _ends_phase(history: list[Record], i: int) -> bool:
    """Whether a record is the first or the last of its phase."""
    phase = history[i].phase
    return i == 0 or history[i - 1].phase != phase or i == len(history) - 1 or history[i + 1].phase != phase


def _betters(history: list[Record], i: int) -> bool:
    return history[i].best_value < history[i - 1].best_value


def before_last_tenth(history: Sequence[Record]) -> float | None:
    """The best value when nine tenths of all iterations were done; None where there were fewer than two."""
    ordinals = _ordinals(history)
    if not ordinals or ordinals[-1] < 2:
        return None
    wanted = ordinals[-1] - max(1, ordinals[-1] // 10)
    return next(
        (r.best_value for r, n in zip(reversed(history), reversed(ordinals), strict=True) if n <= wanted),
        None,
    )
