"""A replay's page holds the whole motion and asks for nothing; plots know where their times are."""

from __future__ import annotations

import base64
import html
import json
import re

import msgspec
import numpy as np
import pytest
import zstandard
from made_replays import boxes_replay

from jffsr.errors import InputError
from jffsr.viz.replay.recording import all_times
from jffsr.viz.replay.serving import ReplayPlayer
from jffsr.viz.replay.viser_server import start_server, stop_server
from jffsr.viz.report.page import replay_page
from jffsr.viz.report.plots import draw_panel

TITLE = 'a "run" <script>alert(1)</script>'


@pytest.fixture(scope="module")
def written():
    return replay_page([boxes_replay(), boxes_replay("later", start=1.0)], TITLE)


def recording(page: str) -> dict:
    """What the page's player gets: messages with their times."""
    inner = html.unescape(re.search(r'srcdoc="([^"]*)"', page)[1])
    data = base64.b64decode(re.search(r'__VISER_EMBED_DATA__="([^"]*)"', inner)[1])
    size = int.from_bytes(data[:8], "little")
    plain = zstandard.ZstdDecompressor().decompress(data[8:], max_output_size=size)
    head = int.from_bytes(plain[:8], "little")
    return msgspec.msgpack.decode(plain[8 : 8 + head])


def last_of(found: dict, kind: str, name: str, before: float = np.inf) -> dict:
    return [m for t, m in found["messages"] if m["type"] == kind and m.get("name") == name and t <= before][
        -1
    ]


def test_a_page_holds_every_move(written):
    found = recording(written)
    # From 0 to the later one's end at 3 s, and half a second to look at the last frame.
    assert found["durationSeconds"] == pytest.approx(3.5)
    end = last_of(found, "SetPositionMessage", "/0/0 slider")["position"]
    np.testing.assert_allclose(end, [3.0, 0.0, 0.0], atol=1e-3)
    half = last_of(found, "SetPositionMessage", "/0/0 slider", before=1.0 + 1e-6)["position"]
    np.testing.assert_allclose(half, [1.5, 0.0, 0.0], atol=1e-3)
    turned = last_of(found, "SetOrientationMessage", "/0/1 turner")["wxyz"]
    np.testing.assert_allclose(turned, np.sqrt([0.5, 0, 0, 0.5]), atol=1e-3)
    colours = [
        m for _, m in found["messages"] if m["type"] == "SceneNodeUpdateMessage" and "slider" in m["name"]
    ]
    assert colours[-1]["updates"]["color"] == [214, 41, 31]


def test_replays_side_by_side_do_not_meet(written):
    found = recording(written)
    first, second = (
        np.array(last_of(found, "SetPositionMessage", root)["position"]) for root in ("/0", "/1")
    )
    assert np.linalg.norm(first - second) > 3.0


def test_a_page_asks_for_nothing(written):
    outer = re.sub(r'srcdoc="[^"]*"', "", written)
    assert not re.search(r'(src|href)="(?!data:|#)', outer)
    assert "@import" not in outer
    assert not re.search(r"url\((?!#)", outer)
    assert len(written) < 3e6


def test_a_title_is_text(written):
    assert "<script>alert" not in re.sub(r'srcdoc="[^"]*"', "", written)
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in written
    numbers = json.loads(re.search(r'id="replay-data">(.*?)</script>', written, re.DOTALL)[1])
    assert numbers["start"] == 0.0
    np.testing.assert_allclose(numbers["plots"][0][0]["values"][0], 3.0 * np.linspace(0, 1, 21), atol=1e-3)


def test_a_plot_knows_where_its_times_are():
    panel = boxes_replay().panels[0]
    plot = draw_panel(panel, (("half", 1.0),), "salt", 100)
    width = float(re.search(r'viewBox="0 0 ([\d.]+) ', plot.svg)[1])
    curve = next(path for path in re.findall(r' d="M ([^"]*)"', plot.svg) if path.count("L") == 20)
    places = np.array([step.split()[:2] for step in curve.replace("L", " ; ").split(";")], float)
    assert places[0, 0] / width == pytest.approx(plot.left, abs=2e-4)
    assert places[-1, 0] / width == pytest.approx(plot.right, abs=2e-4)
    assert (plot.first, plot.last) == (0.0, 2.0)
    assert "<text" in plot.svg


def test_plots_of_one_page_share_no_names():
    panel = boxes_replay().panels[0]
    first, second = (
        set(
            re.findall(r'<(?:clipPath|path|g) id="([a-z]?[0-9a-f]{8,})"', draw_panel(panel, (), salt, 50).svg)
        )
        for salt in "ab"
    )
    assert first
    assert not first & second


def test_replays_that_begin_apart_share_one_clock():
    times = all_times([boxes_replay(start=5.0), boxes_replay(start=4.0, frames=3)])
    assert (times[0], times[-1]) == (4.0, 7.0)
    assert np.all(np.diff(times) > 0)


def test_a_player_plays_stops_and_begins_anew():
    player = ReplayPlayer([boxes_replay(start=1.0), boxes_replay("other")], "two")
    try:
        assert player.url.startswith("http://127.0.0.1:")
        assert player.now == 0.0
        player.advance(1.25)
        assert player.now == pytest.approx(1.25)
        place = player.server.scene.get_handle_by_name("/1/0 slider").position
        np.testing.assert_allclose(place, [3.0 * 0.6, 0, 0], atol=1e-3)
        player.advance(10.0)
        assert player.now == 0.0
        player.go_to(99.0)
        assert player.now == 3.0
        np.testing.assert_allclose(
            player.server.scene.get_handle_by_name("/0/0 slider").position, [3.0, 0, 0], atol=1e-3
        )
    finally:
        player.close()


@pytest.mark.parametrize("port", [0, -1, 65536])
def test_a_port_that_there_is_none_of_is_refused(port):
    with pytest.raises(InputError, match=f"--port {port}: a port is a whole number from 1 to 65535"):
        start_server(port)


def test_a_taken_port_gives_way_to_the_next():
    first = start_server()
    second = start_server(first.get_port())
    try:
        assert second.get_port() != first.get_port()
    finally:
        stop_server(first)
        stop_server(second)
