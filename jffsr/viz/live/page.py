"""The page of a watched run: a wide panel of sentences, charts and a table, brought up to date in place."""

from __future__ import annotations

from typing import Any

import numpy as np

from jffsr.viz.live.news import Chart, News, Table
from jffsr.viz.replay.layout import view_of
from jffsr.viz.replay.replay import Replay
from jffsr.viz.replay.viser_scene import ReplayScene
from jffsr.viz.replay.viser_server import start_server, stop_server

_WIDTH = 800  # pixels
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
        _darken(self.server.scene)
        self._gui = gui
        self._words = gui.add_markdown("", order=0.0)
        self._bar = gui.add_progress_bar(0.0, visible=False, order=1.0)
        self._button = gui.add_button("draw the best motion so far", visible=False, order=50.0)
        self._button.on_click(self._ask)
        self._told = gui.add_markdown("", order=51.0)
        self._table = gui.add_markdown("", order=100.0)
        self.asked = False
        self._motion: MotionView | None = None
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

    def offer(self, motion: bool) -> None:
        """Show or hide the button that asks for the best motion; `asked` says that it was pressed."""
        _set(self._button, "visible", motion)

    def _ask(self, _: Any) -> None:
        self.asked = True

    def tell(self, sentence: str) -> None:
        """A sentence under the button."""
        _set(self._told, "content", f"*{sentence}*" if sentence else "")

    def draw_motion(self, replay: Replay) -> None:
        """Show a motion beside the panel, in place of the last one."""
        self._motion = MotionView(self.server, replay)
        self.tell(replay.title)

    @property
    def plays(self) -> bool:
        """Whether a motion is shown."""
        return self._motion is not None

    def play(self, seconds: float) -> None:
        """Let the motion go on by so much time."""
        if self._motion is not None:
            self._motion.advance(seconds)

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
            ({"label": chart.x_label, "space": 90}, *looks),
            title=f"{chart.title} (power of ten)" if chart.logarithmic else chart.title,
            scales={"x": {"time": False}},
            axes=(
                {"stroke": _INK, "grid": grid, "label": chart.x_label, "space": 90},
                {"stroke": _INK, "grid": grid, "size": 80},
            ),
            height=_HEIGHT,
            order=order,
        )

    def close(self) -> None:
        """End the server."""
        stop_server(self.server)


class MotionView:
    """A motion played again and again in the space beside the panel."""

    def __init__(self, server: Any, replay: Replay):
        server.scene.reset()
        _darken(server.scene)
        self._scene, self._replay = ReplayScene(server, [replay]), replay
        self._now = float(replay.time[0])
        view = view_of([replay])
        # The scene places the camera of who comes later; this is for who is there.
        for client in server.get_clients().values():
            with client.atomic():
                client.camera.up_direction = view.up
                client.camera.position, client.camera.look_at = view.position, view.look_at
                client.camera.fov = view.fov

    def advance(self, seconds: float) -> None:
        """Let so much time pass; from the end on it begins anew."""
        self._now += seconds
        if self._now > self._replay.time[-1]:
            self._now = float(self._replay.time[0])
        self._scene.show(self._now)


def _darken(scene: Any) -> None:
    """An even dark ground beside the panel."""
    scene.set_background_image(np.full((2, 2, 3), (16, 20, 30), np.uint8), format="png")


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
