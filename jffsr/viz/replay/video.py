"""Replays as a video to show around: drawn without a window, several beside each other, with clock and speed."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.viz.replay.film.drawing import Task
from jffsr.viz.replay.film.encoder import encode, encoder
from jffsr.viz.replay.film.offscreen import drawn
from jffsr.viz.replay.film.tiles import tiles
from jffsr.viz.replay.film.timing import Timing, film_timing
from jffsr.viz.replay.film.words import Words
from jffsr.viz.replay.replay import Replay
from jffsr.writing import write_atomically

_SIZES = (160, 4096)
_RATES = (1, 120)


def save_video(
    replays: Replay | Sequence[Replay],
    path: str | Path,
    *,
    width: int = 1280,
    height: int = 720,
    frames_per_second: int = 30,
    speed: float | None = None,
    progress: bool = True,
) -> Path:
    """Write replays to an .mp4 file (H.264, yuv420p), each in a tile with its title and a camera of its own; its path.

    All run by one clock. speed is that of the film over the motion's; without it the film runs in real time or, where
    that would be shorter than 6 s or longer than 20 s, at the round speed next to it. The file appears whole or not at
    all. InputError where a setting is out of range, the place cannot be written, or this machine cannot draw or encode.
    """
    replays = [replays] if isinstance(replays, Replay) else list(replays)
    path = Path(path)
    _check(replays, path, width, height, frames_per_second, speed)
    timing = film_timing(replays, frames_per_second, speed)
    places = tiles(len(replays), width, height)
    words = Words(replays, places, width, height, timing)
    encoder()
    task = Task(replays, places, width, height, timing.times)
    pictures = _written(task, words, timing, path, progress)
    try:
        write_atomically(
            path,
            partial(_encode_to, pictures, size=(width, height), frames_per_second=frames_per_second),
        )
    except (FileNotFoundError, NotADirectoryError, PermissionError, IsADirectoryError) as error:
        raise InputError(
            f"'{path}': the video cannot be written there ({error.strerror or error}); name another place"
        ) from None
    finally:
        pictures.close()
    return path


def _encode_to(pictures: Iterator[np.ndarray], part: Path, size, frames_per_second: int) -> None:
    # The encoder is a process of its own, whose word about a bad place would be long.
    part.touch()
    encode(pictures, part, size, frames_per_second)


def _written(task: Task, words: Words, timing: Timing, path: Path, progress: bool) -> Iterator[np.ndarray]:
    """The pictures with their words, counted by a bar on a terminal."""
    from tqdm import tqdm

    count = len(timing.times)
    with tqdm(
        total=count, unit="frame", desc=path.name, disable=None if progress else True, file=sys.stderr
    ) as bar:
        for picture, instant in zip(drawn(task), timing.times, strict=True):
            yield words.onto(picture, float(instant))
            bar.update()


def _check(replays: list[Replay], path: Path, width, height, frames_per_second, speed) -> None:
    if not replays:
        raise InputError("a video needs at least one replay")
    if path.suffix.lower() != ".mp4":
        raise InputError(f"'{path}': a video is written as .mp4, found the ending '{path.suffix}'")
    for name, value in (("width", width), ("height", height)):
        low, high = _SIZES
        if not isinstance(value, int) or not low <= value <= high or value % 2:
            raise InputError(f"{name} {value}: a video's is an even number of pixels from {low} to {high}")
    low, high = _RATES
    if not isinstance(frames_per_second, int) or not low <= frames_per_second <= high:
        raise InputError(
            f"frames_per_second {frames_per_second}: allowed are whole numbers from {low} to {high}"
        )
    if speed is not None and not (np.isfinite(speed) and speed > 0):
        raise InputError(f"speed {speed}: it is a positive number, 1 for real time")
    for replay in replays:
        if not replay.solids:
            raise InputError(f"replay '{replay.title}': nothing in it could be seen moving")
        if not replay.frames or np.any(np.diff(replay.time) <= 0):
            raise InputError(f"replay '{replay.title}': its times must increase")
