"""Replays as one web page that needs nothing else: viser's own client with the recorded scene in it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from html import escape

import numpy as np

from jffsr.viz.replay.replay import Replay
from jffsr.viz.replay.viser_scene import ReplayScene
from jffsr.viz.replay.viser_server import start_server, stop_server


def all_times(replays: Sequence[Replay]) -> np.ndarray:
    """Every instant, s, at which one of the replays has a frame, in order."""
    return np.unique(np.concatenate([replay.time for replay in replays]))


def record_html(replays: Sequence[Replay], title: str) -> str:
    """The replays as an HTML document that plays them in the motion's own time, with a slider, all in one file.

    Raises InputError where viser is not installed.
    """
    server = start_server()
    try:
        scene = ReplayScene(server, replays)
        serializer = server.get_scene_serializer()
        times = all_times(replays)
        for before, now in itertools.pairwise(times):
            serializer.insert_sleep(float(now - before))
            scene.show(float(now))
        # The last frame stays to be looked at.
        serializer.insert_sleep(0.5)
        page = serializer.as_html(dark_mode=True)
    finally:
        stop_server(server)
    return re.sub(r"<title>[^<]*</title>", lambda _: f"<title>{escape(title)}</title>", page, count=1)
