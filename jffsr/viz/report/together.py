"""Curves of the same quantity of several motions, overlaid in small plots."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from jffsr.viz.replay.replay import Replay
from jffsr.viz.replay.thinning import chosen_samples
from jffsr.viz.report.plots import as_svg
from jffsr.viz.style import GREY, level_look, new_figure, styled

_SIZE = (2.9, 1.45)  # in
_POINTS, _TOGETHER = 200, 20_000
"""Points of a curve: at most, and of all curves of a page together."""
_FEWEST = 40
_MOST_PLOTS = 60


class _Curve(NamedTuple):
    """One motion's curve: which motion, time (k,), s, and values (k,)."""

    motion: int
    time: np.ndarray
    values: np.ndarray


class _Shared(NamedTuple):
    """A quantity that several motions have: name, and a curve of each; bounds are lines across it."""

    name: str
    curves: list[_Curve]
    bounds: tuple[float, ...]
    logarithmic: bool


def curves_together(replays: Sequence[Replay]) -> str:
    """A plot for each curve that at least two of the replays have by the same name, grouped as in their panels.

    An empty text where they have none in common.
    """
    groups = _shared(replays)
    count = sum(len(curves.curves) for quantities in groups.values() for curves in quantities)
    if not count:
        return ""
    points = int(np.clip(_TOGETHER // count, _FEWEST, _POINTS))
    parts, drawn, left_out = [_keys(replays)], 0, 0
    for (title, unit), quantities in groups.items():
        shown = quantities[: max(_MOST_PLOTS - drawn, 0)]
        left_out += len(quantities) - len(shown)
        figures = [
            _figure(title, unit, quantity, points, f"together{drawn + number}")
            for number, quantity in enumerate(shown)
        ]
        drawn += len(shown)
        if figures:
            parts.append(f"<h3>{escape(title)} [{escape(unit)}]</h3>\n")
            parts.append(f'<div class="together">{"".join(figures)}</div>')
    if left_out:
        parts.append(f"<p>{left_out} more quantities that they share are not drawn.</p>")
    return "\n".join(parts)


def _shared(replays: Sequence[Replay]) -> dict[tuple[str, str], list[_Shared]]:
    """The quantities of at least two replays by title and unit of their panel, in the order of the first one."""
    found: dict[tuple[str, str], dict[str, _Shared]] = {}
    for number, replay in enumerate(replays):
        for panel in replay.panels:
            group = found.setdefault((panel.title, panel.unit), {})
            for name, values in panel.curves.items():
                quantity = group.setdefault(name, _Shared(name, [], panel.bounds, panel.logarithmic))
                quantity.curves.append(_Curve(number, panel.time, values))
    shared = {
        key: [quantity for quantity in group.values() if len(quantity.curves) > 1]
        for key, group in found.items()
    }
    return {key: quantities for key, quantities in shared.items() if quantities}


def _keys(replays: Sequence[Replay]) -> str:
    keys = "".join(f"<li>{_line(number)}{escape(replay.title)}</li>" for number, replay in enumerate(replays))
    return f'<ul class="keys runs">{keys}</ul>'


def _line(number: int) -> str:
    """A piece of a motion's line, as its curves are drawn."""
    look = level_look(number)
    pattern = look["linestyle"]
    dashes = "" if pattern == "-" else " ".join(f"{1.6 * length:g}" for length in pattern[1])
    return (
        '<svg class="line" width="34" height="8" aria-hidden="true"><line x1="0" y1="4" x2="34" y2="4" '
        f'stroke="{look["color"]}" stroke-width="2" stroke-dasharray="{dashes}"/></svg>'
    )


@styled
def _figure(title: str, unit: str, quantity: _Shared, points: int, salt: str) -> str:
    figure = new_figure(_SIZE[1], _SIZE[0])
    axes = figure.subplots()
    for curve in quantity.curves:
        chosen = chosen_samples(curve.time, points)
        axes.plot(curve.time[chosen], curve.values[chosen], **level_look(curve.motion))
    for bound in quantity.bounds:
        axes.axhline(bound, color=GREY, linestyle=(0, (4, 2)), linewidth=0.7)
    if quantity.logarithmic:
        axes.set_yscale("log")
    axes.set_xlim(
        min(float(curve.time[0]) for curve in quantity.curves),
        max(float(curve.time[-1]) for curve in quantity.curves),
    )
    axes.set_xlabel("time [s]")
    svg = as_svg(figure, salt, f"{title}, {quantity.name}, of {len(quantity.curves)} motions over time")
    return f'<figure class="plot"><figcaption>{escape(quantity.name)}</figcaption>{svg}</figure>\n'
