"""Replays in a browser window, played by a server on this machine: time, plots, and what is to be seen."""

from __future__ import annotations

import time
import webbrowser
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from jffsr.viz.replay.live_plots import LivePlots
from jffsr.viz.replay.momenta import legend_of
from jffsr.viz.replay.recording import all_times
from jffsr.viz.replay.replay import Replay
from jffsr.viz.replay.viser_scene import ReplayScene
from jffsr.viz.replay.viser_server import start_server, stop_server

_TICK = 1.0 / 30.0  # s
_PLOTS = 3
"""Every so many pictures the plots are drawn anew."""
_SPEEDS = ("0.25x", "0.5x", "1x", "2x", "4x", "8x")
_PLAY, _PAUSE = "play", "pause"
_KINDS = {"ways": "ways of base and tools", "arrows": "momentum", "axes": "axes of tools and targets"}


class ReplayPlayer:
    """A server that shows replays side by side, with a slider for the time and plots whose cursor goes along.

    `server` is the viser.ViserServer, `url` where a browser finds it. Raises InputError where viser is not installed.
    """

    def __init__(self, replays: Sequence[Replay], title: str, port: int | None = None):
        times = all_times(replays)
        self._first, self._last = float(times[0]), float(times[-1])
        self._now, self._drawn, self._pictures = self._first, None, 0
        self.server = start_server(port)
        self.url = f"http://127.0.0.1:{self.server.get_port()}"
        self.server.gui.configure_theme(dark_mode=True, show_logo=False, show_share_button=False)
        self.server.gui.main_panel.dock_right()
        self.server.gui.set_panel_label(title)
        self.scene = ReplayScene(self.server, replays)
        self._controls(replays)

    def _controls(self, replays: Sequence[Replay]) -> None:
        gui = self.server.gui
        step = (self._last - self._first) / 1000.0
        self._slider = gui.add_slider(
            "time [s]", min=self._first, max=self._last, step=step, initial_value=self._first
        )
        self._playing, self._button = True, gui.add_button(_PAUSE)
        self._button.on_click(lambda _: self.play(not self._playing))
        self._speed = gui.add_dropdown("speed", _SPEEDS, initial_value="1x")
        self._slider.on_update(self._slid)
        with gui.add_folder("show", expand_by_default=False):
            for kind, label in _KINDS.items():
                box = gui.add_checkbox(label, True)
                box.on_update(lambda _, kind=kind, box=box: self.scene.hide(kind, not box.value))
        self._plots = LivePlots(gui, replays)
        for line in legend_of(replays):
            gui.add_markdown(f"*{line}*")

    def _slid(self, event: Any) -> None:
        # The player's own moves of the slider come back here, too; only a hand on it stops the play.
        if event.client is None:
            return
        self._now = float(self._slider.value)
        self.play(False)

    def play(self, playing: bool) -> None:
        """Play on, or stand still."""
        self._playing = playing
        self._button.label = _PAUSE if playing else _PLAY

    def go_to(self, instant: float) -> None:
        """Move all that is shown to an instant, s."""
        self._now = float(np.clip(instant, self._first, self._last))
        self._draw()

    @property
    def now(self) -> float:
        """The instant that is shown, s."""
        return self._now

    def advance(self, seconds: float) -> None:
        """Let so much of the viewer's time pass: on from the end, the motion begins anew."""
        if self._playing:
            self._now += seconds * float(self._speed.value.removesuffix("x"))
            if self._now > self._last:
                self._now = self._first
        self._draw()

    def _draw(self) -> None:
        if self._now == self._drawn:
            return
        self._drawn = self._now
        self.scene.show(self._now)
        self._pictures += 1
        if not self._playing or self._pictures % _PLOTS == 0:
            self._plots.show(self._now)
        if self._playing:
            self._slider.value = self._now

    def run(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Play until `stop` says so; KeyboardInterrupt goes through."""
        before = time.monotonic()
        while not stop():
            time.sleep(_TICK)
            now = time.monotonic()
            self.advance(now - before)
            before = now

    def close(self) -> None:
        """End the server."""
        stop_server(self.server)


def serve(replays: Sequence[Replay], title: str, port: int | None = None, open_browser: bool = True) -> None:
    """Show replays in a browser until Ctrl-C; prints where. Raises InputError where viser is not installed."""
    player = ReplayPlayer(replays, title, port)
    try:
        print(f"  replay        {player.url} (Ctrl-C ends it)", flush=True)
        if open_browser:
            webbrowser.open(player.url)
        player.run()
    except KeyboardInterrupt:
        print()
    finally:
        player.close()
