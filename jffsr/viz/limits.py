"""Limits beside curves: a dashed line and a shade beyond it, but only where the curves come near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from jffsr.viz.style import GREY, SHADE

# A limit is drawn when it lies within this fraction of the curves' range beyond them.
_NEAR = 0.3


def frame_curves(
    axes: Axes, values: np.ndarray, lower: np.ndarray, upper: np.ndarray, names: Sequence[str]
) -> bool:
    """Set the vertical range for `values` (N + 1, k) and draw the limits (k,) that are near; say if any was.

    Infinite limits are none. A limit that not all k curves share is marked with the names of those it holds for.
    """
    low, high = _range(values)
    reach = _NEAR * (high - low)
    drawn = [
        (level, [name for name, limit in zip(names, limits, strict=True) if limit == level], above)
        for limits, above in ((np.asarray(lower), False), (np.asarray(upper), True))
        for level in np.unique(limits[np.isfinite(limits)])
        if low - reach <= level <= high + reach
    ]
    levels = [level for level, _, _ in drawn]
    low, high = min([low, *levels]), max([high, *levels])
    pad = 0.07 * (high - low)
    axes.set_ylim(low - pad, high + pad)
    for level, holders, above in drawn:
        axes.axhline(level, color=GREY, linestyle=(0, (4, 2)), linewidth=0.7, zorder=1, gid="limit")
        if len(holders) == len(names):
            axes.axhspan(level, (high + pad) if above else (low - pad), color=SHADE, linewidth=0, zorder=0)
        else:
            _write_holders(axes, level, holders, names, above)
    return bool(drawn)


def _range(values: np.ndarray) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    # What does not move gets a range of its own, not the width of rounding.
    smallest = max(1e-6 * max(abs(low), abs(high)), 1e-9)
    return (low, high) if high - low > smallest else (low - 0.5, high + 0.5)


def _write_holders(axes: Axes, level: float, holders: list[str], names: Sequence[str], above: bool) -> None:
    places = [list(names).index(name) for name in holders]
    consecutive = len(places) > 2 and places == list(range(places[0], places[-1] + 1))
    text = f"{holders[0]} … {holders[-1]}" if consecutive else ", ".join(holders[:3])
    if len(holders) > 3 and not consecutive:
        text += ", …"
    axes.annotate(
        text,
        (1.0, level),
        xycoords=("axes fraction", "data"),
        xytext=(-2, -1.5 if above else 1.5),
        textcoords="offset points",
        ha="right",
        va="top" if above else "bottom",
        fontsize=6,
        color=GREY,
    )
