"""Which instants of a motion become the pictures of a film, and how much faster than the motion it runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jffsr.errors import InputError
from jffsr.viz.replay.replay import Replay

SHORTEST, LONGEST = 6.0, 20.0
"""How long a film lasts, s, where no speed is asked for."""
_HELD = 0.5
"""How long the last picture stands, s, before a player begins again."""
_MOST_FRAMES = 36_000
_STEPS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)


class Timing(NamedTuple):
    """times (K,), s, of the motion at the pictures; start and end, s, of the motion; speed, motion to film."""

    times: np.ndarray
    start: float
    end: float
    speed: float


def film_timing(replays: Sequence[Replay], frames_per_second: int, speed: float | None = None) -> Timing:
    """When pictures are taken: evenly from the first start to the last end, and the end for half a second more.

    Without `speed` the film runs in real time, or at the round speed that keeps it between 6 and 20 s. InputError
    where a film would have more than 36,000 pictures.
    """
    start = min(float(replay.time[0]) for replay in replays)
    end = max(float(replay.time[-1]) for replay in replays)
    speed = _speed(end - start) if speed is None else speed
    # Nothing moves: as long as a short film.
    lasts = (end - start) / speed if end > start else SHORTEST
    moving, held = lasts * frames_per_second, round(_HELD * frames_per_second)
    if moving > _MOST_FRAMES:
        raise InputError(
            f"speed {speed:g}: a film of {end - start:g} s at {frames_per_second} pictures a second would have "
            f"{moving:.0f} pictures, at most {_MOST_FRAMES} are allowed; use a larger speed"
        )
    shares = np.linspace(0.0, 1.0, max(round(moving), 1) + 1)
    times = start + (end - start) * np.concatenate([shares, np.ones(held)])
    return Timing(times, start, end, speed)


def speed_text(speed: float) -> str:
    """The speed in the picture: nothing in real time, else for example x2."""
    return "" if speed == 1.0 else f"x{speed:.3g}"


def _speed(span: float) -> float:
    if span > LONGEST:
        return _round(span / LONGEST, up=True)
    if 0.0 < span < SHORTEST:
        return _round(span / SHORTEST, up=False)
    return 1.0


def _round(speed: float, up: bool) -> float:
    """The next round number above, or below."""
    power = 10.0 ** math.floor(math.log10(speed))
    # Rounding must not push 2 to 2.5.
    steps = [round(step * power, 12) for step in _STEPS]
    if up:
        return min(step for step in steps if step >= speed * (1 - 1e-9))
    return max(step for step in steps if step <= speed * (1 + 1e-9))
