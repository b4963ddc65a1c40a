"""Where a film's camera stands, how the picture is divided, what is written, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from replay_of_boxes import box, sliding, two_boxes
from scipy.spatial.transform import Rotation

from jffsr.errors import InputError
from jffsr.viz.replay.film.camera import FIELD, camera_for, cameras_for, is_flat
from jffsr.viz.replay.film.drawing import Task
from jffsr.viz.replay.film.facets import corner_normals
from jffsr.viz.replay.film.offscreen import drawn
from jffsr.viz.replay.film.tiles import strip_height, tiles
from jffsr.viz.replay.film.timing import film_timing
from jffsr.viz.replay.film.viewpoint import view_axes
from jffsr.viz.replay.film.words import Words
from jffsr.viz.replay.replay import Replay, Solid
from jffsr.viz.replay.shading import AT, NEAR
from jffsr.viz.replay.video import save_video


def tumbling(frames: int = 9) -> Replay:
    """A cube that moves and turns in space."""
    turn = Rotation.from_rotvec(np.linspace(0.0, 2.0, frames)[:, None] * [0.6, 0.0, 0.8])
    place = np.linspace([0.0, 0.0, 0.0], [3.0, 1.0, 2.0], frames)
    solid = Solid("cube", *box(1.0), (0.5, 0.5, 0.6), place, turn.as_quat(scalar_first=True))
    return Replay("tumbling", np.linspace(0.0, 4.0, frames), (solid,))


@pytest.mark.parametrize("replay", [two_boxes(), tumbling()])
@pytest.mark.parametrize("aspect", [0.6, 1.0, 2.0])
def test_everything_is_in_the_picture_and_fills_it(replay, aspect):
    camera = camera_for([replay], aspect)
    half = np.tan(np.deg2rad(FIELD / 2))
    reached = []
    for share in (0.0, 0.25, 0.5, 1.0):
        # The camera is looked through by scipy's rotations: x to the right, y up, z to the camera.
        turn = Rotation.from_euler(
            "ZX", [camera.azimuth_at(share) - 90.0, 90.0 - camera.elevation], degrees=True
        )
        for solid in replay.solids:
            for position, quaternion in zip(solid.position, solid.quaternion, strict=True):
                corners = Rotation.from_quat(quaternion, scalar_first=True).apply(solid.vertices) + position
                x, y, z = turn.inv().apply(corners - camera.look_at).T
                reached += [np.abs(x) / (half * aspect * (camera.distance - z))]
                reached += [np.abs(y) / (half * (camera.distance - z))]
    assert np.concatenate(reached).max() < 1.0
    assert np.concatenate(reached).max() > 0.55


def test_a_motion_in_the_plane_is_seen_from_above():
    assert is_flat(two_boxes())
    assert not is_flat(tumbling())
    assert camera_for([two_boxes()], 1.5).elevation > 45.0 > camera_for([tumbling()], 1.5).elevation


def test_replays_of_the_same_bodies_are_seen_alike():
    near, other, again = two_boxes("a"), tumbling(), two_boxes("b", span=9.0)
    cameras = cameras_for([near, other, again], 1.0)
    assert cameras[0] is cameras[2]
    assert cameras[1].elevation != cameras[0].elevation


def test_a_small_body_is_seen_in_front_of_the_large_one_that_would_hide_it():
    for side in ([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]):
        small = 1.4 * np.array(side)
        solids = (
            sliding("large", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 3, side=2.0),
            sliding("small", (0.5, 0.5, 0.5), small, small + np.array([0.0, 0.0, 0.4]), 3, side=0.2),
        )
        camera = camera_for([Replay("hidden", np.arange(3.0), solids)], 1.5)
        # The camera stands on the small body's side of the large one.
        assert view_axes(camera.azimuth, camera.elevation)[2] @ side > 0.3


@pytest.mark.parametrize("count", range(1, 13))
def test_tiles_lie_beside_each_other_above_the_strip(count):
    found = tiles(count, 1280, 720)
    taken = np.zeros((720, 1280), int)
    for tile in found:
        taken[tile.top : tile.top + tile.height, tile.left : tile.left + tile.width] += 1
    assert len(found) == count
    assert taken.max() == 1
    assert not taken[-strip_height(720) :].any()
    assert sum(tile.width * tile.height for tile in found) == taken.sum()


def test_too_many_replays_for_a_picture_are_refused():
    with pytest.raises(InputError, match="40 replays in a picture of 320 x 2"):
        tiles(40, 320, 240)


def test_the_normals_of_a_box_stand_on_its_faces():
    vertices, faces = box(2.0)
    normals = corner_normals(vertices, faces)
    outward = vertices[faces].mean(axis=1)
    # The middle of a triangle of a face x = 1 has 1 for its largest coordinate.
    axis = np.argmax(np.abs(outward), axis=1)
    expected = np.sign(outward[np.arange(12), axis])[:, None] * np.eye(3)[axis]
    np.testing.assert_allclose(normals, np.repeat(expected[:, None], 3, axis=1), atol=1e-9)


def test_the_normals_of_a_fine_tube_point_away_from_its_axis_on_both_sides():
    around = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    i = np.arange(40)
    j = (i + 1) % 40
    faces = np.concatenate([np.stack([i, j, j + 40], 1), np.stack([i, j + 40, i + 40], 1)])
    vertices = np.concatenate([ring, ring + np.array([0.0, 0.0, 3.0])])
    normals = corner_normals(vertices, np.concatenate([faces, faces[:, ::-1]]))
    outward = vertices[faces] * [1.0, 1.0, 0.0]
    np.testing.assert_allclose(normals[: len(faces)], outward, atol=0.03)
    np.testing.assert_allclose(normals[len(faces) :], -outward[:, ::-1], atol=0.03)


@pytest.mark.parametrize(
    ("nearest", "amber", "red"), [(None, 0, 0), (0.5, 0, 0), (0.8, 1, 0), (1.2, 1, 1), (np.nan, 1, 1)]
)
def test_the_strip_says_what_the_colours_mean_that_come_up(nearest, amber, red):
    nearness = None if nearest is None else np.array([0.1, 0.2, nearest, 0.1, 0.0])
    replay = two_boxes(span=8.0, nearness=nearness)
    timing = film_timing([replay], 30)
    picture = Words([replay], tiles(1, 1280, 720), 1280, 720, timing).onto(
        np.zeros((720, 1280, 3), np.uint8), 0.0
    )
    strip = picture[720 - strip_height(720) :]
    for colour, squares in ((NEAR, amber), (AT, red)):
        here = np.all(strip == np.round(255 * np.array(colour)).astype(int), axis=2)
        # A square of twelve pixels, or thirteen.
        assert (here.sum() in (144, 156, 169)) if squares else not here.any()
    # The mark's name and the clock keep clear of them.
    line = (strip[strip.shape[0] // 2 :].max(axis=2) > 60).any(axis=0)
    assert line[24:200].any()
    assert line[610:670].any()
    assert not line[680:740].any()


def test_title_clock_and_bar_are_written():
    replay = two_boxes(span=8.0)
    timing = film_timing([replay], 30)
    words = Words([replay], tiles(1, 640, 360), 640, 360, timing)
    dark = np.full((360, 640, 3), 10, np.uint8)
    early, late = words.onto(dark, 1.0), words.onto(dark, 7.0)
    assert (early[:24, :200].max(axis=2) > 200).sum() > 50
    assert not (early[:24, 300:].max(axis=2) > 200).any()
    strip = slice(360 - strip_height(360), 360)
    # The clock differs, the bar has grown, and nothing else has changed.
    changed = (early != late).any(axis=2)
    assert changed[strip, :100].any()
    assert not changed[: strip.start].any()
    blue = [(part[strip, :, 2].astype(int) - part[strip, :, 0] > 80).sum() for part in (early, late)]
    assert blue[1] > 4 * blue[0] > 0


def test_a_long_title_is_shortened():
    replay = two_boxes("a title that is far too long for such a narrow picture as this one")
    timing = film_timing([replay], 30)
    dark = np.zeros((240, 320, 3), np.uint8)
    written = Words([replay], tiles(1, 320, 240), 320, 240, timing).onto(dark, 0.0)
    assert written[:16, 150:308].any()
    assert not written[:16, 313:].any()


@pytest.mark.parametrize(
    ("settings", "word"),
    [
        ({"path": "film.gif"}, "written as .mp4, found the ending '.gif'"),
        ({"width": 641}, "width 641: a video's is an even number"),
        ({"height": 90}, "height 90"),
        ({"frames_per_second": 0}, "frames_per_second 0"),
        ({"speed": -2.0}, "speed -2.0: it is a positive number"),
        ({"speed": float("nan")}, "speed nan"),
        ({"replays": []}, "at least one replay"),
    ],
)
def test_what_no_film_can_be_made_of_is_refused(settings, word, tmp_path):
    given = {"replays": [two_boxes()], "path": "film.mp4", **settings}
    path = tmp_path / given.pop("path")
    with pytest.raises(InputError, match=word.replace(".", r"\.")):
        save_video(given.pop("replays"), path, **given)
    assert not list(tmp_path.iterdir())


def test_a_replay_without_bodies_or_with_times_that_stand_is_refused(tmp_path):
    replay = two_boxes()
    with pytest.raises(InputError, match="'two boxes': nothing in it"):
        save_video(Replay("two boxes", replay.time, ()), tmp_path / "film.mp4")
    with pytest.raises(InputError, match="its times must increase"):
        save_video(Replay("two boxes", 0 * replay.time, replay.solids), tmp_path / "film.mp4")


def test_a_missing_encoder_is_named_with_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r"imageio-ffmpeg.*pip install 'jffsr\[show\]'"):
        save_video(two_boxes(), tmp_path / "film.mp4")


@pytest.mark.parametrize("value", ["off", "vulkan"])
def test_an_opengl_that_does_not_draw_is_refused(value, tmp_path, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", value)
    with pytest.raises(InputError, match=f"MUJOCO_GL.*{value}.*egl"):
        save_video(two_boxes(), tmp_path / "film.mp4")
    assert not list(tmp_path.iterdir())


def test_a_machine_that_cannot_draw_is_told_what_to_install(monkeypatch):
    monkeypatch.setattr("jffsr.viz.replay.film.offscreen._libraries", lambda: ("no_such_library",))
    solid = sliding("cube", (0.5, 0.5, 0.5), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 3)
    replay = Replay("cube", np.arange(3.0), (solid,))
    task = Task([replay], tiles(1, 320, 240), 320, 240, np.arange(3.0))
    with pytest.raises(InputError, match=r"no video can be drawn.*no_such_library: .*MUJOCO_GL=egl"):
        next(drawn(task))
