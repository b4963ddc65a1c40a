"""Limits beside curves: a dashed line and a shade beyond it, but only where the curves come near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from jffsr.viz.style import GREY, SHADE

# A limit that all curves share is drawn when it lies within this fraction of their range beyond them,
_NEAR = 0.5
# and one that only some have, when one of these comes as close as this: others would only be in the way.
_CLOSE = 0.12
_LONGEST = 32  # letters on a limit's line


def frame_curves(
    axes: Axes, values: np.ndarray, lower: np.ndarray, upper: np.ndarray, names: Sequence[str]
) -> bool:
    """Set the vertical range for `values` (N + 1, k) and draw the limits (k,) that are near; say if any was.

    Infinite limits are none. A limit that not all k curves share is marked with the names of those that do;
    one that all share but none comes near is told in a corner instead of squashing the curves.
    """
    low, high = _range(values)
    span = high - low
    drawn = []
    for limits, side in ((np.asarray(lower), -1), (np.asarray(upper), 1)):
        for level in np.unique(limits[np.isfinite(limits)]):
            shared = bool(np.all(limits == level))
            reach = (_NEAR if shared else _CLOSE) * span
            held = np.flatnonzero(limits == level)
            peaks = [_peak(values[:, index], side) for index in held]
            if any(side * (level - peak) <= reach for peak in peaks):
                drawn.append((float(level), side, None if shared else [names[index] for index in held]))
    levels = [level for level, _, _ in drawn]
    low, high = min([low, *levels]), max([high, *levels])
    pad = 0.07 * (high - low)
    axes.set_ylim(low - pad, high + pad)
    written: list[float] = []
    for level, side, holders in drawn:
        axes.axhline(level, color=GREY, linestyle=(0, (4, 2)), linewidth=0.7, zorder=1, gid="limit")
        if holders is None:
            axes.axhspan(level, (high + pad) if side > 0 else (low - pad), color=SHADE, linewidth=0, zorder=0)
        elif all(abs(level - other) > 0.11 * (high - low) for other in written):
            _write_holders(axes, level, holders, names)
            written.append(level)
    _tell_far_limits(axes, np.asarray(lower), np.asarray(upper), levels)
    return bool(drawn)


def _tell_far_limits(axes: Axes, lower: np.ndarray, upper: np.ndarray, drawn: list[float]) -> None:
    both = np.concatenate([lower, upper])
    if not np.all(np.isfinite(both)) or np.ptp(lower) > 0 or np.ptp(upper) > 0:
        return
    low, high = float(lower[0]), float(upper[0])
    if low in drawn or high in drawn:
        return
    text = f"limit \N{PLUS-MINUS SIGN}{high:.3g}" if low == -high else f"limits {low:.3g} to {high:.3g}"
    axes.annotate(
        text,
        (1.0, 1.0),
        xycoords="axes fraction",
        xytext=(-2, -1),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=6,
        color="0.3",
        zorder=1.5,
        gid="far limit",
    )


def _peak(curve: np.ndarray, side: int) -> float:
    """The curve's greatest value (least for side -1); never near anything where nothing is finite."""
    finite = curve[np.isfinite(curve)]
    return float(side * np.max(side * finite)) if finite.size else -side * np.inf


def _range(values: np.ndarray) -> tuple[float, float]:
    finite = values[np.isfinite(values)]
    if finite.size == 0:
        return -1.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    # What does not move gets a range of its own, not the width of rounding.
    smallest = max(1e-6 * max(abs(low), abs(high)), 1e-9)
    return (low, high) if high - low > smallest else (low - 0.5, high + 0.5)


def _write_holders(axes: Axes, level: float, holders: list[str], names: Sequence[str]) -> None:
    places = [list(names).index(name) for name in holders]
    text = ", ".join(holders)
    if len(holders) > 2 and places == list(range(places[0], places[-1] + 1)):
        text = f"{holders[0]} … {holders[-1]}"
    if len(holders) > 1 and len(text) > _LONGEST:
        text = f"{holders[0]} and {len(holders) - 1} more"
    axes.annotate(
        text,
        (1.0, level),
        xycoords=("axes fraction", "data"),
        xytext=(-2, -0.5),
        textcoords="offset points",
        ha="right",
        va="center",
        fontsize=6,
        color="0.3",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.3},
        zorder=1.5,  # over its own line and under every curve
    )
