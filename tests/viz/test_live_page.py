"""The page of a watched folder: a server that answers, keeps up, and ends."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from replay_of_boxes import two_boxes

import jffsr
from jffsr import cli
from jffsr.errors import InputError
from jffsr.study import planning
from jffsr.study.config import dump_config, load_config
from jffsr.viz.live.news import Chart, News
from jffsr.viz.live.page import LivePage
from jffsr.viz.live.watching import refresh, serve_live, watch_of
from jffsr.viz.replay.reading import replays_of

PATIENCE = 120.0  # s, far more than anything here takes

PLANAR = """\
kind: planning
robot: hu_2011_planar2
limits: {position_deg: 180, rate: 0.5, acceleration: 0.5}
task: {start_deg: [80, 30], goal_deg: [-60, 90], duration: 20}
rollout: {num_steps: 8}
verification: {step_factor: 2, sensitivity: false}
optimizer: {kind: qpso, particles: 4, evaluations: 4000}
output: {figures: false, progress: false}
"""


@pytest.fixture
def page():
    made = LivePage("run test")
    yield made
    made.close()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def news(*values: float, **more) -> News:
    x = np.arange(1.0, 1.0 + len(values))
    charts = (Chart("best J", "evaluations", x, {"best J": np.array(values)}),) if values else ()
    return News("under way", False, (("points", str(len(values))),), charts, **more)


def test_a_chart_is_kept_while_it_grows_and_made_anew_for_another_axis(page):
    page.show(news())
    assert not page._charts
    page.show(news(4.0, 2.0))
    plot = page._charts["best J"][1]
    page.show(news(4.0, 2.0, 0.01))
    assert page._charts["best J"][1] is plot
    np.testing.assert_allclose(plot.data[1], np.log10([4.0, 2.0, 0.01]), rtol=1e-12)
    page.show(news(4.0, 2.0, 0.01, -1.0))
    assert page._charts["best J"][1] is not plot
    np.testing.assert_array_equal(page._charts["best J"][1].data[1], [4.0, 2.0, 0.01, -1.0])
    page.show(news())
    assert not page._charts


def test_words_and_bar_follow_the_news(page):
    page.show(news(1.0, share=0.25))
    assert page._bar.visible
    assert page._bar.value == 25.0
    assert "| points | 1 |" in page._words.content
    page.show(news(1.0, 0.5))
    assert not page._bar.visible
    assert "| points | 2 |" in page._words.content


def test_the_server_answers_on_this_machine_alone_and_ends(tmp_path, capsys):
    (tmp_path / "config.yaml").write_text(dump_config(load_config("composite_wu6")), encoding="utf-8")
    port, ended = free_port(), threading.Event()
    thread = threading.Thread(target=serve_live, args=(tmp_path, port, False, ended.is_set))
    thread.start()
    try:
        url = f"http://127.0.0.1:{port}"
        assert answer(url) == 200
        assert f"{url} (Ctrl-C ends it)" in capsys.readouterr().out
        with (
            pytest.raises(OSError, match=r"refused|assign|reach"),
            socket.create_connection(("127.0.0.2", port), 5),
        ):
            pass
    finally:
        ended.set()
        thread.join(PATIENCE)
    assert not thread.is_alive()
    with pytest.raises(OSError, match="refused"), socket.create_connection(("127.0.0.1", port), 5):
        pass


def answer(url: str) -> int:
    """The status of a page that may take a moment to be there."""
    for _ in range(int(PATIENCE / 0.1)):
        try:
            with urllib.request.urlopen(url, timeout=10) as reply:
                return reply.status
        except urllib.error.URLError:
            time.sleep(0.1)
    return 0


def test_the_button_is_there_only_with_a_motion_and_its_refusal_is_told(page):
    def refuse():
        raise InputError("the search has found no motion yet")

    watch = SimpleNamespace(news=news, has_motion=False, motion=refuse)
    refresh(page, watch)
    assert not page._button.visible
    watch.has_motion = True
    refresh(page, watch)
    assert page._button.visible
    assert page._told.content == ""
    page._ask(None)
    refresh(page, watch)
    assert "no motion yet" in page._told.content
    assert not page.plays
    assert not page.asked


def test_a_motion_is_played_again_and_again(page):
    watch = SimpleNamespace(news=news, has_motion=True, motion=lambda: two_boxes("best so far", span=2.0))
    page.play(1.0)
    for _ in range(2):
        page._ask(None)
        refresh(page, watch)
        assert page.plays
        assert page._told.content == "*best so far*"
    # Frames are at 0, 0.5, 1, 1.5 and 2 s.
    shown = []
    for _ in range(6):
        page.play(0.5)
        shown.append(page._motion._scene._shown[0])
    assert shown == [1, 2, 3, 4, 0, 1]


@pytest.mark.slow
def test_the_best_motion_so_far_is_that_of_the_checkpoint(tmp_path, monkeypatch):
    """At the end of a search the checkpoint's motion is the one that is then written as the run's result."""
    config, folder, kept = tmp_path / "planar.yaml", tmp_path / "run", tmp_path / "kept"
    config.write_text(PLANAR.replace("4000", "40"), encoding="utf-8")
    finish = planning._finish

    def keep(folder, *rest):
        kept.mkdir()
        for path in (folder.config, folder.checkpoint):
            shutil.copy(path, kept)
        finish(folder, *rest)

    monkeypatch.setattr(planning, "_finish", keep)
    cli.main(["run", str(config), "--out", str(folder)])
    assert watch_of(kept).has_motion
    assert not watch_of(folder).has_motion
    found, result = watch_of(kept).motion(), replays_of(folder)[0]
    assert "best after 40 evaluations" in found.title
    np.testing.assert_allclose(found.time, result.time, atol=1e-12)
    for one, other in zip(found.solids, result.solids, strict=True):
        assert one.name == other.name
        np.testing.assert_allclose(one.position, other.position, atol=1e-9)
        np.testing.assert_allclose(one.quaternion, other.quaternion, atol=1e-9)
    (kept / "checkpoint.npz").write_bytes(b"damaged")
    with pytest.raises(InputError, match="checkpoint cannot be read"):
        watch_of(kept).motion()
    (kept / "checkpoint.npz").unlink()
    with pytest.raises(InputError, match="no checkpoint, and so no motion, yet"):
        watch_of(kept).motion()


@pytest.mark.slow
def test_a_run_is_watched_from_its_first_line_to_its_end(tmp_path):
    config, folder = tmp_path / "planar.yaml", tmp_path / "run"
    config.write_text(PLANAR, encoding="utf-8")
    root = str(Path(jffsr.__file__).parents[1])
    command = [sys.executable, "-m", "jffsr.cli", "run", str(config), "--out", str(folder)]
    with open(tmp_path / "log", "wb") as log:
        run = subprocess.Popen(
            command, stdout=log, stderr=subprocess.STDOUT, env={**os.environ, "PYTHONPATH": root}
        )
    try:
        while not (folder / "config.yaml").is_file():
            assert run.poll() is None, (tmp_path / "log").read_text()
            time.sleep(0.05)
        watch, counts, headlines = watch_of(folder), [], set()
        while run.poll() is None:
            found = watch.news()
            headlines.add(found.headline)
            counts.append(int(dict(found.facts).get("evaluations", 0)))
            time.sleep(0.02)
    finally:
        run.kill()
        run.wait()
    assert counts == sorted(counts)
    assert any(headline.startswith("under way") for headline in headlines)
    last = watch.news()
    assert last.finished
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert last.headline == f"finished: {summary['result']['sentence']}"
    assert int(dict(last.facts)["evaluations"]) == summary["evaluations"]["objective"]
    best = last.charts[0].curves["best J"]
    assert np.all(np.diff(best) <= 0)
