"""How near bodies come to each other, as colours, a plot over time and a sentence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jffsr.viz.replay.of_robot import Extras
from jffsr.viz.replay.replay import Panel

_CLOSE = 0.2
"""m beyond the margin, from where on bodies count as near each other."""


def add_clearance(
    extras: Extras,
    time: np.ndarray,
    apart: np.ndarray,
    pairs: Sequence[tuple[str, str]],
    margin: float,
    who: str,
) -> None:
    """Colour the bodies of pairs by their signed distances `apart` (p, N), m, at time (N,), s, and plot the smallest.

    margin, m, is the distance that they are to keep; `who` begins the sentence about them in the legend.
    """
    curve = {"clearance": apart.min(axis=0)}
    extras.panels += (Panel("nearest two bodies", "m", time, curve, bounds=(margin,)),)
    near = np.clip(1.0 - (apart - margin) / _CLOSE, 0.0, None)
    for body in dict.fromkeys(name for pair in pairs for name in pair):
        own = near[[number for number, pair in enumerate(pairs) if body in pair]].max(axis=0)
        extras.nearness[body] = np.maximum(extras.nearness.get(body, 0.0), own)
    extras.legend += (
        f"{who} how near they come to each other: red at {margin:g} m, the margin between them.",
    )
