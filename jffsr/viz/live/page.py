"""The page of a watched run: a wide panel of sentences, charts and a table, brought up to date in place."""

from __future__ import annotations

from typing import Any

import numpy as np

from jffsr.viz.live.news import Chart, News, Table
from jffsr.viz.replay.viser_server import start_server, stop_server

_WIDTH = 860  # pixels
_HEIGHT = 300
_INK, _FAINT = "#e6e9ee", "#3a4254"
_LINES = ("#6aa8f7", "#f2a65a")


class LivePage:
    """A server on 127.0.0.1 that shows news; `url` is where. InputError where viser is not installed."""

    def __init__(self, title: str, port: int | None = None):
        self.server = start_server(port)
        self.url = f"http://127.0.0.1:{self.server.get_port()}"
        gui = self.server.gui
        gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_WIDTH)
        gui.set_panel_label(title)
        # There is nothing to be seen in space: an even ground beside the panel.
        self.server.scene.set_background_image(np.full((2, 2, 3), (16, 20, 30), np.uint8), format="png")
        self._gui = gui
        self._words = gui.add_markdown("", order=0.0)
        self._bar = gui.add_progress_bar(0.0, visible=False, order=1.0)
        self._table = gui.add_markdown("", order=100.0)
        self._charts: dict[str, tuple[tuple, Any]] = {}

    def show(self, news: News) -> None:
        """Bring the page up to date; what has not changed is not sent."""
        _set(self._words, "content", words(news))
        _set(self._bar, "visible", news.share is not None)
        if news.share is not None:
            _set(self._bar, "value", 100.0 * news.share)
        _set(self._table, "content", table(news.table) if news.table else "")
        for place, chart in enumerate(news.charts):
            self._draw(chart, 2.0 + place)
        for gone in self._charts.keys() - {chart.title for chart in news.charts}:
            self._charts.pop(gone)[1].remove()

    def _draw(self, chart: Chart, order: float) -> None:
        # The viewer's own logarithmic axis writes 0 for what is small: powers of ten are drawn instead.
        curves = [np.log10(y) if chart.logarithmic else y for y in chart.curves.values()]
        data = tuple(np.asarray(part, float) for part in (chart.x, *curves))
        form = (chart.logarithmic, chart.x_label, tuple(chart.curves))
        before, plot = self._charts.get(chart.title, (None, None))
        if plot is not None and before == form:
            if len(plot.data[0]) != len(data[0]) or any(map(_differ, plot.data, data)):
                plot.data = data
            return
        if plot is not None:
            plot.remove()
        self._charts[chart.title] = (form, self._plot(chart, data, order))

    def _plot(self, chart: Chart, data: tuple[np.ndarray, ...], order: float) -> Any:
        looks = tuple(
            {
                "label": f"log10 of {name}" if chart.logarithmic else name,
                "stroke": _LINES[number % len(_LINES)],
                "width": 2.0,
                "points": {"show": len(data[0]) < 60},
            }
            for number, name in enumerate(chart.curves)
        )
        grid = {"stroke": _FAINT, "width": 1}
        return self._gui.add_uplot(
            data,
            ({"label": chart.x_label}, *looks),
            title=f"{chart.title} (power of ten)" if chart.logarithmic else chart.title,
            scales={"x": {"time": False}},
            axes=(
                {"stroke": _INK, "grid": grid, "label": chart.x_label},
                {"stroke": _INK, "grid": grid, "size": 80},
            ),
            height=_HEIGHT,
            order=order,
        )

    def close(self) -> None:
        """End the server."""
        stop_server(self.server)


def words(news: News) -> str:
    """Headline and facts as Markdown."""
    facts = "\n".join(f"| {name} | {_cell(value)} |" for name, value in news.facts)
    hint = f"`{news.hint}`\n\n" if news.hint else ""
    return f"### {news.headline}\n\n{hint}| | |\n|---|---|\n{facts}\n"


def table(found: Table) -> str:
    """A table as Markdown, with a line on what is left out."""
    lines = [
        "| " + " | ".join(map(_cell, row)) + " |"
        for row in (found.head, ("---",) * len(found.head), *found.rows)
    ]
    more = f"\n\n{found.left_out} more are not shown." if found.left_out else ""
    return "\n".join(lines) + more


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _differ(one: np.ndarray, other: np.ndarray) -> bool:
    return not np.array_equal(one, other)


def _set(handle: Any, name: str, value: Any) -> None:
    if getattr(handle, name) != value:
        setattr(handle, name, value)
