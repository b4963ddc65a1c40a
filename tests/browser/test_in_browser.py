"""Pages in a real browser: they open from disk without a network, play, follow the mouse, and complain of nothing."""

from __future__ import annotations

import io
import threading

import numpy as np
import pytest
from install_browser import own_browser, system_browser
from made_replays import boxes_replay
from PIL import Image

from jffsr import cli
from jffsr.viz.replay.serving import ReplayPlayer
from jffsr.viz.report.page import replay_page

pytestmark = pytest.mark.browser

# Without a graphics card, without the many things that a browser asks its maker for.
FLAGS = [
    "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
    "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip
PLAN = ["optimizer.particles=10", "optimizer.evaluations=100", "task.duration=20"]
LOAD_MS = 120_000


class Opened:
    """A page, with everything that it said and asked for."""

    def __init__(self, browser, url: str, size=(1400, 900)):
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]})
        self.page = self.context.new_page()
        self.page.set_default_timeout(LOAD_MS)
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(url)

    def asked_outside(self, own: str) -> list[str]:
        return [
            url for url in self.requests if not url.startswith((own, "data:", f"blob:{own}", "blob:null"))
        ]

    def picture(self, selector: str) -> np.ndarray:
        data = self.page.locator(selector).first.screenshot()
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), float)


class Replayed(Opened):
    """A page with a replay, once that plays."""

    def __init__(self, browser, url: str):
        super().__init__(browser, url)
        self.player = self.page.frame_locator("#replay-frame")
        self.slider = self.player.locator("[role=slider]")
        self.slider.wait_for(state="attached")
        self.page.locator("#replay").scroll_into_view_if_needed()
        self.page.wait_for_function(
            "document.querySelector('.plots:not([hidden]) output').textContent !== ''"
        )

    def now(self) -> float:
        return float(self.slider.get_attribute("aria-valuenow"))

    def click(self, selector: str, share: float) -> None:
        box = self.page.locator(selector).first.bounding_box()
        self.page.mouse.click(box["x"] + share * box["width"], box["y"] + 0.4 * box["height"])
        self.page.wait_for_timeout(1500)

    def cursor(self) -> float:
        """Where the first plot's cursor is, as a share of its drawing."""
        return self.page.evaluate(
            "() => { const d = document.querySelector('.plots:not([hidden]) .drawing');"
            " const b = d.getBoundingClientRect(), c = d.querySelector('.cursor').getBoundingClientRect();"
            " return (c.left - b.left) / b.width; }"
        )

    def plot(self) -> dict[str, float]:
        data = self.page.locator(".plots:not([hidden]) .drawing").first.evaluate("d => ({...d.dataset})")
        return {name: float(value) for name, value in data.items()}


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    path = system_browser() or own_browser()
    assert path, "no Chromium: run tests/browser/install_browser.py"
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """The report of a small planned motion."""
    folder = tmp_path_factory.mktemp("shown") / "plan"
    assert cli.main(["run", "composite_wu6", *PLAN, "--out", str(folder)]) in (cli.MET, cli.NOT_MET)
    assert cli.main(["show", str(folder), "--report", "--no-serve"]) == cli.MET
    return folder / "report.html"


@pytest.fixture(scope="module")
def opened(browser, report):
    found = Replayed(browser, report.as_uri())
    yield found
    found.context.close()


def test_the_report_plays_and_pauses(opened):
    first = opened.now()
    opened.page.wait_for_timeout(2000)
    assert opened.now() > first
    opened.slider.locator("xpath=ancestor::*[contains(@class, 'mantine-Paper-root')]//button").first.click()
    opened.page.wait_for_timeout(500)
    paused = opened.now()
    opened.page.wait_for_timeout(1500)
    assert opened.now() == paused


@pytest.mark.parametrize("share", [0.75, 0.3])
def test_a_click_on_a_plot_moves_the_replay(opened, share):
    opened.click(".drawing", share)
    plot = opened.plot()
    expected = 20.0 * (share - plot["left"]) / (plot["right"] - plot["left"])
    assert opened.now() == pytest.approx(expected, abs=0.1)
    assert opened.cursor() == pytest.approx(share, abs=0.01)


def test_the_slider_moves_replay_and_plots(opened):
    track = opened.slider.locator("xpath=ancestor::*[contains(@class, 'mantine-Slider-root')]").bounding_box()
    opened.page.mouse.click(track["x"] + 0.5 * track["width"], track["y"] + 0.5 * track["height"])
    opened.page.wait_for_timeout(1500)
    # The recording ends half a second after the motion.
    assert opened.now() == pytest.approx(10.25, abs=0.3)
    plot = opened.plot()
    assert opened.cursor() == pytest.approx(
        plot["left"] + opened.now() / 20.0 * (plot["right"] - plot["left"]), abs=0.01
    )


def test_the_robot_is_seen_and_moves(opened):
    pictures = []
    for share in (0.12, 0.6):
        opened.click(".drawing", share)
        opened.page.wait_for_timeout(2500)
        pictures.append(opened.picture("#replay-frame")[80:-80, 20:-20])
    assert pictures[0].std() > 10
    changed = np.abs(pictures[1] - pictures[0]).max(axis=-1) > 40
    assert 0.002 < changed.mean() < 0.6


def test_the_report_complains_of_nothing_and_asks_nobody(opened, report):
    assert opened.errors == []
    assert opened.asked_outside(report.as_uri()) == []


def test_a_page_of_two_replays_changes_its_plots(browser, tmp_path):
    file = tmp_path / "two.html"
    file.write_text(replay_page([boxes_replay("first"), boxes_replay("second")], "two"), encoding="utf-8")
    page = Replayed(browser, file.as_uri())
    assert page.page.locator(".plots:visible").get_attribute("data-replay") == "0"
    page.page.select_option("#replay-choice", "1")
    assert page.page.locator(".plots:visible").get_attribute("data-replay") == "1"
    page.click('.plots[data-replay="1"] .drawing', 0.5)
    assert page.cursor() == pytest.approx(0.5, abs=0.01)
    assert page.errors == []
    assert page.asked_outside(file.as_uri()) == []
    page.context.close()


def test_a_served_replay_is_seen_and_can_be_moved(browser):
    player = ReplayPlayer([boxes_replay(duration=30.0)], "boxes")
    done = threading.Event()
    play = threading.Thread(target=player.run, args=(done.is_set,))
    play.start()
    try:
        page = Opened(browser, player.url)
        page.page.locator("canvas").first.wait_for()
        page.page.get_by_text("time [s]").wait_for()
        page.page.wait_for_timeout(6000)
        picture = page.picture("canvas")
        assert picture.std() > 5
        now = player.now
        page.page.wait_for_timeout(1000)
        assert player.now > now
        page.page.get_by_role("button", name="pause").click()
        page.page.wait_for_timeout(1500)
        paused = player.now
        page.page.wait_for_timeout(1000)
        assert player.now == paused
        field = page.page.locator("input[inputmode=decimal]").first
        field.fill("12")
        field.press("Enter")
        page.page.wait_for_timeout(1500)
        assert player.now == pytest.approx(12.0, abs=0.1)
        page.page.get_by_role("button", name="play").click()
        page.page.wait_for_timeout(1500)
        assert player.now > 12.1
        assert page.errors == []
        assert page.asked_outside(player.url) == []
        page.context.close()
    finally:
        done.set()
        play.join()
        player.close()
