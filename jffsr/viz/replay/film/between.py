"""A replay at any instant: positions and nearness along straight lines between its frames, attitudes the short way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Place(NamedTuple):
    """Between which frames an instant is: frame `index`, and the share [0, 1] of the way to the one after it."""

    index: int
    share: float


def place_at(time: np.ndarray, instant: float) -> Place:
    """Where an instant, s, is among the frames at time (F,), s; before the first it is the first, then the last."""
    if len(time) == 1 or instant <= time[0]:
        return Place(0, 0.0)
    index = min(int(np.searchsorted(time, instant, side="right")) - 1, len(time) - 2)
    step = time[index + 1] - time[index]
    return Place(index, float(min((instant - time[index]) / step, 1.0)) if step > 0 else 1.0)


def mixed(values: np.ndarray, place: Place) -> np.ndarray:
    """Values (F, ...) at a place; a frame's own where it is met, however its neighbour may be."""
    before = values[place.index]
    if place.share == 0.0:
        return before
    after = values[place.index + 1]
    if place.share == 1.0:
        return after
    return before + place.share * (after - before)


def turned(quaternions: np.ndarray, place: Place) -> np.ndarray:
    """The unit quaternion (4,) at a place among (F, 4), w first: at a constant rate, the shorter way round."""
    before = quaternions[place.index] / np.linalg.norm(quaternions[place.index])
    if place.share == 0.0:
        return before
    after = quaternions[place.index + 1] / np.linalg.norm(quaternions[place.index + 1])
    cosine = before @ after
    if cosine < 0.0:
        after, cosine = -after, -cosine
    angle = np.arccos(min(cosine, 1.0))
    if angle < 1e-6:
        return after
    one, other = np.sin((1.0 - place.share) * angle), np.sin(place.share * angle)
    return (one * before + other * after) / np.sin(angle)


def near(values: np.ndarray | None, place: Place) -> float:
    """Nearness at a place among (F,); 0 without any. Where one side is not finite, neither is what is between."""
    if values is None:
        return 0.0
    with np.errstate(invalid="ignore"):
        return float(mixed(values, place))
