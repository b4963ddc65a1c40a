"""When a motion is near a singularity: stretches of time below a threshold, and the worst instants in them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jffsr.tracking.singularity.between import find_minimum, find_zero

# A dip shallower than this share of the largest singular value is rounding.
_SHALLOW = 1e-9


class Event(NamedTuple):
    """An instant, s, at which the smallest singular value is least, and whether the determinant changes sign there."""

    time: float
    crossing: bool


class Stretch(NamedTuple):
    """A stretch of time, s, near a singularity, with its instants."""

    start: float
    end: float
    events: tuple[Event, ...]


Measure = Callable[[np.ndarray], np.ndarray]


def find_stretches(
    times: np.ndarray, smallest: Measure, determinant: Measure | None, threshold: float, scale: float
) -> tuple[tuple[Stretch, ...], Event]:
    """The stretches of a motion where its smallest singular value is below a threshold, and the nearest instant of all.

    times (p,) are looked at one by one, and the measures between them where they change; scale is the size of the
    largest singular value. Every change of the determinant's sign is an instant of a stretch, however short.
    """
    values = smallest(times)
    crossings = [] if determinant is None else _crossings(times, values, determinant, _SHALLOW * scale)
    events = [Event(time, True) for time in crossings]
    events += [Event(time, False) for time in _minima(times, values, smallest, crossings, _SHALLOW * scale)]
    events.sort()
    depths = smallest(np.array([event.time for event in events]))
    closest = events[int(np.argmin(depths))]
    deep = [event for event, depth in zip(events, depths, strict=True) if depth < threshold or event.crossing]
    return _stretches(times, values, smallest, deep, threshold), closest


def _crossings(times: np.ndarray, values: np.ndarray, determinant: Measure, shallow: float) -> list[float]:
    negative = np.signbit(determinant(times))
    # Where the task is never met, the determinant is rounding and its sign means nothing.
    certain = np.maximum(values[1:], values[:-1]) > shallow
    places = np.flatnonzero((negative[1:] != negative[:-1]) & certain)
    return [find_zero(determinant, times[i], times[i + 1]) for i in places]


def _minima(
    times: np.ndarray, values: np.ndarray, smallest: Measure, crossings: list[float], shallow: float
) -> list[float]:
    """Times of the minima that are no crossing; an end of the motion counts where it is lower than its neighbour."""
    found = []
    for place in _dips(values, shallow):
        low, high = times[max(place - 1, 0)], times[min(place + 1, len(times) - 1)]
        if not any(low <= crossing <= high for crossing in crossings):
            found.append(find_minimum(smallest, low, high) if high > low else float(low))
    return found


def _dips(values: np.ndarray, shallow: float) -> list[int]:
    """Places of the minima that rise by more than `shallow` on both sides, or on one at an end; at least one."""
    found: list[int] = []
    place, highest, falling = 0, -np.inf, True
    for i, value in enumerate(values):
        if falling:
            if value < values[place]:
                place = i
            elif value > values[place] + shallow:
                found.append(place)
                highest, falling = value, False
        elif value > highest:
            highest = value
        elif value < highest - shallow:
            place, falling = i, True
    return [*found, place] if falling else found


def _stretches(
    times: np.ndarray, values: np.ndarray, smallest: Measure, events: list[Event], threshold: float
) -> tuple[Stretch, ...]:
    """Events joined where the value stays below the threshold between them, with the ends of each stretch refined."""

    def excess(at: np.ndarray) -> np.ndarray:
        return smallest(at) - threshold

    def edge(event: Event, side: int) -> float:
        beyond = times[(times - event.time) * side > 0][::side]
        above = values[(times - event.time) * side > 0][::side] >= threshold
        if not above.any():
            return float(times[-1] if side > 0 else times[0])
        place = int(np.argmax(above))
        inner = beyond[place - 1] if place else event.time
        return find_zero(excess, *sorted((inner, beyond[place])))

    found: list[Stretch] = []
    for event in events:
        if found and event.time <= found[-1].end:
            found[-1] = found[-1]._replace(events=(*found[-1].events, event))
        else:
            found.append(Stretch(edge(event, -1), edge(event, 1), (event,)))
    return tuple(found)
