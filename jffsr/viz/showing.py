"""What `jffsr show` makes of finished runs and sweeps: figures, a replay, a page, a video, a report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.study.run_folder import RunFolder
from jffsr.study.sweep.folder import SweepFolder
from jffsr.viz.replay.momenta import with_one_scale
from jffsr.viz.replay.replay import Replay
from jffsr.writing import write_atomically

SWEEP = "sweep"
_PAGES = (".html", ".htm")
_MOST = 16
"""Replays that are shown side by side."""


def read_summary(path: str | Path) -> dict[str, Any]:
    """The summary of a finished run, or of a sweep that came to its end; InputError where there is none."""
    from jffsr.study.sweep.ended import read_ended

    folder = RunFolder(Path(path))
    # A sweep of which points are missing has no summary.json.
    if not folder.finished and SweepFolder(folder.path).result.is_file():
        return read_ended(path)
    return folder.read_summary()


def is_sweep(path: str | Path) -> bool:
    """Whether the folder is that of a finished sweep; InputError where it is not finished, or neither."""
    return read_summary(path).get("kind") == SWEEP


def draw(path: str | Path) -> list[Path]:
    """The figures of a finished run or sweep, drawn into its folder."""
    if is_sweep(path):
        from jffsr.viz.sweep import draw_sweep

        return draw_sweep(path)
    from jffsr.viz.run import draw_run

    return draw_run(path)


def replays_of_all(paths: Sequence[str | Path]) -> list[Replay]:
    """The replays of all runs, by their folders' names where there are several; InputError where nothing moved."""
    found = []
    for path, name in zip(paths, _names(paths), strict=True):
        replays = _replays(path)
        if len(paths) > 1:
            replays = [
                replay.named(name if len(replays) == 1 else f"{name}: {replay.title}") for replay in replays
            ]
        found += replays
    if len(found) > _MOST:
        raise InputError(f"these runs hold {len(found)} motions; at most {_MOST} are shown side by side")
    return with_one_scale(found)


def write_page(paths: Sequence[str | Path], file: Path) -> Path:
    """The replays of runs, side by side, as one HTML file; of several runs also in what they differ."""
    from jffsr.viz.report.page import replay_page

    _check_page(file)
    replays = replays_of_all(paths)
    return _write(file, replay_page(replays, _title(paths), _comparison(paths, replays)))


def write_report(path: str | Path, figures: Sequence[Path], file: Path) -> Path:
    """The report of a run or sweep as one HTML file."""
    _check_page(file)
    if is_sweep(path):
        from jffsr.viz.report.sweep import sweep_report

        return _write(file, sweep_report(path, figures))
    from jffsr.viz.report.report import run_report

    return _write(file, run_report(path, figures))


def write_video(paths: Sequence[str | Path], file: Path) -> Path:
    """The replays of runs, side by side, as an mp4."""
    from jffsr.viz.replay.video import save_video

    return save_video(replays_of_all(paths), file)


def serve_replays(paths: Sequence[str | Path], port: int | None, open_browser: bool) -> None:
    """Show the replays of runs, side by side, in a browser until Ctrl-C."""
    from jffsr.viz.replay.serving import serve

    serve(replays_of_all(paths), _title(paths), port, open_browser)


def can_serve() -> bool:
    """Whether what a replay in a browser needs is installed."""
    from importlib.util import find_spec

    return find_spec("viser") is not None


def _replays(path: str | Path) -> list[Replay]:
    if is_sweep(path):
        from jffsr.viz.replay.of_sweep import sweep_replays

        return sweep_replays(Path(path))
    from jffsr.viz.replay.reading import replays_of

    return replays_of(path)


def _comparison(paths: Sequence[str | Path], replays: Sequence[Replay]) -> str:
    from jffsr.viz.report.differences import compared_runs, read_run
    from jffsr.viz.report.together import curves_together

    if len(paths) < 2:
        return ""
    names = _names(paths)
    runs = [read_run(path, name, read_summary(path)) for path, name in zip(paths, names, strict=True)]
    return compared_runs(runs, curves_together(replays))


def _title(paths: Sequence[str | Path]) -> str:
    return " | ".join(_names(paths))


def _names(paths: Sequence[str | Path]) -> list[str]:
    """The folders' names, with the folders around them where two are called alike."""
    places = [Path(path).resolve() for path in paths]
    names = [place.name for place in places]
    if len(set(names)) == len(set(places)):
        return names
    return [f"{place.parent.name}/{place.name}" for place in places]


def _check_page(file: Path) -> None:
    if file.suffix.lower() not in _PAGES:
        raise InputError(f"{file}: a page is written as .html, found the ending '{file.suffix}'")


def _write(file: Path, text: str) -> Path:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(file, lambda part: part.write_text(text, encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be written ({error.strerror or error})") from None
    return file
