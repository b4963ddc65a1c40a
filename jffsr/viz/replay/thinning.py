"""Which samples of a run become frames of its replay."""

from __future__ import annotations

import numpy as np

FRAMES = 240
"""How many frames a replay has at most: a viewer moves smoothly, and a page stays small."""
_TOGETHER, _FEWEST = 1500, 90


def frames_each(count: int) -> int:
    """How many frames each of `count` replays has that are shown together: a page of all of them stays small, too."""
    return min(FRAMES, max(_FEWEST, _TOGETHER // count))


def chosen_samples(time: np.ndarray, most: int = FRAMES) -> np.ndarray:
    """Indices of at most `most` of the samples at time (N,), s, evenly spaced in time, the first and last among them.

    Samples that are closer together than the frames are skipped; where they are farther apart, all are taken.
    """
    if len(time) <= most:
        return np.arange(len(time))
    wanted = np.linspace(time[0], time[-1], most)
    after = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
    nearer = wanted - time[after - 1] < time[after] - wanted
    return np.unique(after - nearer)
