"""Points drawn at random: `random: {count, seed, keys: {key: {uniform: [a, b]}}}`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from jffsr.reading.did_you_mean import listed
from jffsr.reading.yaml_lines import Document, Key
from jffsr.study.sweep.entries import Entries

UNIFORM, LOG_UNIFORM, INTEGERS, CHOICE = "uniform", "log_uniform", "integers", "choice"
LAWS = (UNIFORM, LOG_UNIFORM, INTEGERS, CHOICE)
MOST_DRAWS = 100_000


@dataclass(frozen=True)
class Draws:
    """The section as written, and the points drawn from it: for each the values of all keys."""

    values: dict[str, Any]
    points: tuple[tuple[Document, ...], ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that are drawn."""
        return tuple(self.values["keys"])


def read_draws(entries: Entries) -> Draws:
    """The draws of the section `random`; raises InputError.

    Each key is drawn from a stream of its own, named by the seed and the key's place, so that raising `count` keeps
    the points that there were.
    """
    import numpy as np

    entries.keys_at(("random",))
    entries.refuse_unknown(("random",), ("count", "seed", "keys"))
    count = _whole(entries, ("random", "count"), 1, MOST_DRAWS)
    seed = _whole(entries, ("random", "seed"), 0, 2**32 - 1) if entries.has("random", "seed") else 0
    if not entries.has("random", "keys"):
        raise entries.refusal(("random", "keys"), "missing, a mapping of keys to what they are drawn from")
    columns = []
    for number, key in enumerate(entries.keys_at(("random", "keys"))):
        place = ("random", "keys", key)
        rng = np.random.default_rng([seed, number])
        columns.append([entries.document(key, value, place) for value in _drawn(entries, place, rng, count)])
    values = {"count": count, "seed": seed, "keys": entries.value("random", "keys")}
    return Draws(values, tuple(zip(*columns, strict=True)))


def _drawn(entries: Entries, place: Key, rng: Any, count: int) -> list[Any]:
    law = entries.value(*place)
    if not isinstance(law, dict) or len(law) != 1 or next(iter(law)) not in LAWS:
        names = listed(f"{{{name}: [...]}}" for name in LAWS)
        raise entries.refusal(place, f"{names} is expected")
    name = next(iter(law))
    items = entries.list_at((*place, name), "values")
    if name == CHOICE:
        return [items[int(i)] for i in rng.integers(len(items), size=count)]
    low, high = _interval(entries, (*place, name), items, positive=name == LOG_UNIFORM)
    if name == INTEGERS:
        if not all(isinstance(end, int) for end in items):
            raise entries.refusal((*place, name), f"found {items}, two whole numbers are expected")
        return [int(value) for value in rng.integers(low, high, size=count, endpoint=True)]
    share = rng.random(count)
    if name == UNIFORM:
        return [float(low + (high - low) * part) for part in share]
    return [float(low * math.exp(math.log(high / low) * part)) for part in share]


def _interval(entries: Entries, place: Key, items: list[Any], positive: bool) -> tuple[float, float]:
    numbers = [item for item in items if isinstance(item, int | float) and not isinstance(item, bool)]
    if (
        len(items) != 2
        or len(numbers) != 2
        or not all(map(math.isfinite, numbers))
        or not numbers[0] < numbers[1]
        or (positive and not numbers[0] > 0)
    ):
        kind = "0 < low < high" if positive else "low < high"
        raise entries.refusal(place, f"found {str(items)[:60]}, a pair [low, high] with {kind} is expected")
    return numbers[0], numbers[1]


def _whole(entries: Entries, place: Key, low: int, high: int) -> int:
    value = entries.value(*place)
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        found = "nothing" if value is None else str(value)[:60]
        raise entries.refusal(place, f"found {found}, a whole number in [{low}, {high}] is expected")
    return value
