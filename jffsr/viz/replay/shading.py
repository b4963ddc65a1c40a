"""The colour of what comes near a limit: its own while far, amber on the way, red at the limit and beyond."""

from __future__ import annotations

import numpy as np

from jffsr.viz.replay.replay import Colour

FAR = 0.7
"""Nearness up to which nothing is coloured."""
NEAR: Colour = (0.93, 0.66, 0.12)
AT: Colour = (0.84, 0.16, 0.12)
_STEPS = 8
STATES = ((NEAR, "at 85 % of a limit"), (AT, "at a limit or beyond it"))
"""What the two colours stand for; up to 70 % a thing has its own."""


def warned(colour: Colour, nearness: float) -> Colour:
    """`colour`, or what it becomes from 0.7 on: amber at 0.85, red at 1 and where it is not finite."""
    if not np.isfinite(nearness):
        return AT
    # A few steps: what does not change is not sent again.
    share = np.ceil(_STEPS * np.clip((nearness - FAR) / (1.0 - FAR), 0.0, 1.0)) / _STEPS
    path = np.array([colour, NEAR, AT])
    return tuple(float(np.interp(2.0 * share, (0.0, 1.0, 2.0), path[:, part])) for part in range(3))
