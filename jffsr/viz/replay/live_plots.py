"""Plots in the panel of a viser server, with a cursor at the instant that the replay shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from jffsr.viz.replay.replay import Panel, Replay
from jffsr.viz.replay.thinning import chosen_samples
from jffsr.viz.style import COLOURS

_POINTS = 150
_HEIGHT = 150  # pixels
_OPEN = 3
"""How many plots are open from the beginning."""
_CURSOR = "#ff6b6b"
_ON_DARK = "#e6e9ee"


class LivePlots:
    """The plots of one of the replays, in folders; `show(time)` moves their cursors."""

    def __init__(self, gui: Any, replays: Sequence[Replay]):
        titles = [f"{number + 1} {replay.title}" for number, replay in enumerate(replays)]
        self._chosen, self._now = 0, float(replays[0].time[0])
        if len(titles) > 1:
            choice = gui.add_dropdown("plots of", titles, initial_value=titles[0])
            choice.on_update(lambda _: self._choose(titles.index(choice.value)))
        self._groups = [
            [self._add(gui, panel, number == 0, place < _OPEN) for place, panel in enumerate(replay.panels)]
            for number, replay in enumerate(replays)
        ]

    def show(self, time: float) -> None:
        """Put the cursors at an instant, s."""
        self._now = time
        for _, plot, curves in self._groups[self._chosen]:
            plot.data = curves.at(time)

    def _add(self, gui: Any, panel: Panel, visible: bool, opened: bool) -> tuple[Any, Any, _Curves]:
        curves = _Curves(panel)
        folder = gui.add_folder(f"{panel.title} [{panel.unit}]", expand_by_default=opened, visible=visible)
        with folder:
            plot = gui.add_uplot(
                curves.at(self._now),
                curves.series(),
                scales=curves.scales(panel.logarithmic),
                axes=({"stroke": _ON_DARK}, {"stroke": _ON_DARK}),
                height=_HEIGHT,
            )
        return folder, plot, curves

    def _choose(self, number: int) -> None:
        for place, group in enumerate(self._groups):
            for folder, _, _ in group:
                folder.visible = place == number
        self._chosen = number
        self.show(self._now)


class _Curves:
    """A panel's curves, and a line across them at an instant: the chart has no cursor that a program can move."""

    def __init__(self, panel: Panel):
        chosen = chosen_samples(panel.time, _POINTS)
        self._time = np.asarray(panel.time, float)[chosen]
        self._values = np.array([np.asarray(curve, float)[chosen] for curve in panel.curves.values()])
        self._names = list(panel.curves)
        finite = self._values[np.isfinite(self._values)]
        self._low, self._high = (finite.min(), finite.max()) if finite.size else (0.0, 1.0)

    def at(self, time: float) -> tuple[np.ndarray, ...]:
        """The times, the curves, and the line across at an instant."""
        place = int(np.searchsorted(self._time, time))
        three = [place] * 3
        times = np.insert(self._time, three, time)
        # At the instant itself the curves go straight on.
        curves = [np.insert(curve, three, np.interp(time, self._time, curve)) for curve in self._values]
        # Along the bottom and once up to the top: the chart cannot leave points out.
        line = np.full(len(times), self._low)
        line[place + 1] = self._high
        return (times, *curves, line)

    def scales(self, logarithmic: bool) -> dict[str, dict]:
        """What the axes span: all of the motion."""
        if logarithmic:
            # The chart divides whole decades.
            low, high = 10.0 ** np.floor(np.log10(self._low)), 10.0 ** np.ceil(np.log10(self._high))
            upright = {"range": (float(low), float(max(high, 10.0 * low))), "distr": 3}
        else:
            pad = 0.05 * (self._high - self._low) or 1.0
            upright = {"range": (float(self._low - pad), float(self._high + pad))}
        across = {"time": False, "range": (float(self._time[0]), float(self._time[-1]))}
        return {"x": across, "y": upright}

    def series(self) -> tuple[dict, ...]:
        """How the chart draws each."""
        looks = [
            {
                "label": name,
                "stroke": _ON_DARK if number % len(COLOURS) == 0 else COLOURS[number % len(COLOURS)],
                "width": 1.5,
            }
            for number, name in enumerate(self._names)
        ]
        return ({"label": "time"}, *looks, {"label": "now", "stroke": _CURSOR, "width": 1.5})
