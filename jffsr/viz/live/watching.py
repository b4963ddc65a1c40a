"""Watching a run or a sweep in a browser until it is enough."""

from __future__ import annotations

import time
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from jffsr.errors import InputError
from jffsr.study.sweep.specification import is_sweep
from jffsr.viz.live.news import News
from jffsr.viz.live.page import LivePage

if TYPE_CHECKING:
    from jffsr.viz.replay.replay import Replay

_EVERY, _PICTURE = 1.0, 1.0 / 30.0  # s


class Watch(Protocol):
    """Something that tells how a folder stands."""

    name: str
    kind: str
    has_motion: bool

    def news(self) -> News:
        """How it stands now."""

    def motion(self) -> Replay:
        """The best motion so far; InputError where there is none."""


def watch_of(path: str | Path) -> Watch:
    """What looks into a run's or a sweep's folder, finished or not; InputError where the folder is neither."""
    path = Path(path)
    if not path.exists():
        raise InputError(f"{path}: there is no such folder")
    if not path.is_dir():
        raise InputError(f"{path}: is a file; give the folder of a run or a sweep")
    config = path / "config.yaml"
    if not config.is_file():
        raise InputError(f"{path}: not the folder of a run or a sweep (no config.yaml)")
    if is_sweep(str(config)):
        from jffsr.viz.live.of_sweep import SweepWatch

        return SweepWatch(path)
    from jffsr.viz.live.of_run import RunWatch

    return RunWatch(path)


def serve_live(
    path: str | Path,
    port: int | None = None,
    open_browser: bool = True,
    stop: Callable[[], bool] = lambda: False,
) -> None:
    """Show how a run or a sweep gets on in a browser, until Ctrl-C or until `stop` says so; prints where.

    Everything is read from the folder once a second; the process that works there is left alone. Raises InputError
    where the folder is of neither, and where viser is not installed.
    """
    watch = watch_of(path)
    page = LivePage(f"{watch.kind} {watch.name}" if watch.kind == "sweep" else f"run {watch.name}", port)
    try:
        refresh(page, watch)
        print(f"  watching      {page.url} (Ctrl-C ends it)", flush=True)
        if open_browser:
            webbrowser.open(page.url)
        looked = before = time.monotonic()
        while not stop():
            time.sleep(_PICTURE if page.plays else _EVERY)
            now = time.monotonic()
            page.play(now - before)
            before = now
            if now - looked >= _EVERY:
                looked = now
                refresh(page, watch)
    except KeyboardInterrupt:
        print()
    finally:
        page.close()


def refresh(page: LivePage, watch: Watch) -> None:
    """Look once, and draw the motion if somebody asked for it."""
    page.show(watch.news())
    page.offer(watch.has_motion)
    if not page.asked:
        return
    page.asked = False
    page.tell("drawing the best motion; the first takes some seconds")
    try:
        page.draw_motion(watch.motion())
    except InputError as error:
        page.tell(str(error))
