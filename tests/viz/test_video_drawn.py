"""Films that are drawn, encoded and decoded again: what is in their pictures. Needs OpenGL: make check-video."""

from __future__ import annotations

import os
import subprocess
from ctypes.util import find_library
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from replay_of_boxes import two_boxes

from jffsr.errors import InputError
from jffsr.viz.replay.film.tiles import strip_height, tiles
from jffsr.viz.replay.video import save_video

pytestmark = pytest.mark.video
SIZE = {"width": 480, "height": 320, "frames_per_second": 10}


class Film(NamedTuple):
    """A decoded film: what is said of its stream, and its pictures (K, h, w, 3)."""

    says: str
    pictures: np.ndarray


def film(path: Path, width: int = SIZE["width"], height: int = SIZE["height"]) -> Film:
    """Decode a film of this size."""
    import imageio_ffmpeg

    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    says = next(line for line in done.stderr.decode().splitlines() if "Video:" in line)
    return Film(says, np.frombuffer(done.stdout, np.uint8).reshape(-1, height, width, 3).astype(int))


@pytest.fixture(scope="module")
def passing(tmp_path_factory) -> Film:
    """Two seconds of the two boxes, the green one of which comes to its limit halfway."""
    path = tmp_path_factory.mktemp("film") / "passing.mp4"
    replay = two_boxes(nearness=np.array([0.0, 0.0, 0.0, 1.0, 1.0]))
    return film(save_video(replay, path, **SIZE, speed=1.0, progress=False))


def inside(film: Film) -> np.ndarray:
    """The pictures without the rows of the title, the names of the lines and the strip."""
    height = film.pictures.shape[1]
    return film.pictures[:, 30 : height - strip_height(height) - 22]


def where(pictures: np.ndarray, channel: int, over: int) -> tuple[np.ndarray, np.ndarray]:
    """How many pixels (K,) have more of a channel than of both others by `over`, and where they are in x on average."""
    others = np.delete(pictures, channel, axis=3).max(axis=3)
    mask = pictures[..., channel] - others > over
    count = mask.sum(axis=(1, 2))
    return count, (mask * np.arange(pictures.shape[2])).sum(axis=(1, 2)) / np.maximum(count, 1)


def test_a_film_has_the_size_length_and_form_asked_for(passing):
    for word in ("h264", "yuv420p(tv, bt709, progressive", "480x320", " 10 fps"):
        assert word in passing.says
    # Two seconds, both ends, and the last picture for half a second more.
    assert len(passing.pictures) == 20 + 1 + 5


def test_no_picture_is_blank_and_neighbours_differ(passing):
    seen = inside(passing)
    assert (seen.std(axis=(1, 2, 3)) > 10).all()
    changes = np.abs(np.diff(seen[:21], axis=0)).max(axis=(1, 2, 3))
    assert (changes > 30).all()


def test_a_body_that_moves_to_the_right_does_so_in_the_picture(passing):
    count, place = where(inside(passing)[:11], 1, 50)
    assert (count > 60).all()
    assert (np.diff(place) > 4).all()
    assert place[0] < 240


def test_a_body_at_its_limit_is_red(passing):
    seen = inside(passing)
    before, _ = where(seen[:8], 0, 80)
    after, _ = where(seen[16:21], 0, 80)
    assert before.max() < 30  # one of the axes' three lines
    assert after.min() > 100


def test_a_way_grows_and_one_ahead_is_there_from_the_start(passing):
    seen = inside(passing)[:21]
    magenta = np.minimum(seen[..., 0], seen[..., 2]) - seen[..., 1] > 45
    assert magenta[0].sum() < 10
    ends = [np.flatnonzero(picture.any(axis=0))[[0, -1]] for picture in magenta[4::4]]
    assert (np.diff([end for _, end in ends]) > 30).all()
    assert np.ptp([start for start, _ in ends]) < 20
    cyan = np.minimum(seen[..., 1], seen[..., 2]) - seen[..., 0] > 40
    wide = [np.ptp(np.flatnonzero(picture.any(axis=0))) for picture in cyan[[0, 10, 20]]]
    assert min(wide) > 0.95 * max(wide) > 200


def test_an_arrow_is_drawn(passing):
    first = inside(passing)[0]
    yellow = np.minimum(first[..., 0], first[..., 1]) - first[..., 2] > 50
    assert yellow.sum() > 20


def test_title_and_clock_are_in_the_picture(passing):
    title = passing.pictures[:, :24, :160].max(axis=3)
    assert ((title > 180).sum(axis=(1, 2)) > 60).all()
    clock = passing.pictures[:, -16:, 5:60]
    assert ((clock.max(axis=3) > 180).sum(axis=(1, 2)) > 20).all()
    assert np.abs(clock[20] - clock[5]).max() > 100


def test_several_replays_have_tiles_of_their_own(tmp_path):
    still, moving = two_boxes("still", frames=1, span=0.0), two_boxes("moving", span=1.0)
    path = save_video([still, moving], tmp_path / "both.mp4", **SIZE, speed=1.0, progress=False)
    pictures = film(path).pictures
    assert len(pictures) == 10 + 1 + 5
    left, right = tiles(2, 480, 320)
    travelled = []
    for tile in (left, right):
        part = pictures[:11, tile.top + 30 : tile.top + tile.height - 30, tile.left : tile.left + tile.width]
        count, place = where(part, 1, 50)
        assert (count > 20).all()
        travelled.append(place[-1] - place[0])
    # What stands still moves only as far as the camera does.
    assert travelled[1] > 60 > 10 > abs(travelled[0])


def test_every_library_that_is_here_draws_the_same(tmp_path, monkeypatch):
    libraries = [name for name in ("EGL", "OSMesa") if find_library(name)]
    assert libraries, "neither libEGL nor libOSMesa is installed"
    pictures = []
    for library in libraries:
        monkeypatch.setenv("MUJOCO_GL", library.lower())
        path = save_video(two_boxes(span=0.5), tmp_path / f"{library}.mp4", **SIZE, speed=1.0, progress=False)
        pictures.append(film(path).pictures)
        assert pictures[-1].shape == pictures[0].shape
        assert np.abs(pictures[-1] - pictures[0]).mean() < 2.0


def test_a_film_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="cannot be written there"):
        save_video(two_boxes(span=0.5), tmp_path / "nowhere" / "film.mp4", **SIZE, progress=False)
    (tmp_path / "film.mp4").mkdir()
    with pytest.raises(InputError, match="cannot be written there"):
        save_video(two_boxes(span=0.5), tmp_path / "film.mp4", **SIZE, speed=1.0, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]


def test_one_interrupted_leaves_what_was_there(tmp_path, monkeypatch):
    path = tmp_path / "film.mp4"
    path.write_bytes(b"an older film")

    def interrupt(self, picture, instant):
        raise KeyboardInterrupt

    monkeypatch.setattr("jffsr.viz.replay.video.Words.onto", interrupt)
    with pytest.raises(KeyboardInterrupt):
        save_video(two_boxes(span=0.5), path, **SIZE, progress=False)
    assert path.read_bytes() == b"an older film"
    assert os.listdir(tmp_path) == ["film.mp4"]
