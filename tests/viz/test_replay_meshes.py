"""Triangles of a replay enclose the volume of their shapes; colours and frames are chosen as they should be."""

from __future__ import annotations

import numpy as np
import pytest
from made_replays import boxes_replay
from scipy.spatial.transform import Rotation

from jffsr.robots.geometry import BOX, CAPSULE, CYLINDER, ELLIPSOID, SPHERE, Shape
from jffsr.viz.replay.layout import places, view_of
from jffsr.viz.replay.meshes import merged, triangles
from jffsr.viz.replay.shading import AT, NEAR, warned
from jffsr.viz.replay.thinning import FRAMES, chosen_samples, frames_each
from jffsr.viz.solids import cylinder_between, shape_faces


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    """By Gauss's theorem; positive where the triangles are counter-clockwise seen from outside."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return float(np.sum(np.cross(a, b) * c) / 6)


@pytest.mark.parametrize(
    ("kind", "size", "expected", "off"),
    [
        (BOX, [0.5, 1.0, 1.5], 6.0, 1e-6),
        (SPHERE, [2.0], 4 / 3 * np.pi * 8, 0.03),
        (ELLIPSOID, [1.0, 2.0, 3.0], 4 / 3 * np.pi * 6, 0.03),
        (CYLINDER, [0.5, 1.0], np.pi * 0.25 * 2, 0.02),
        (CAPSULE, [0.5, 1.0], np.pi * 0.25 * 2 + 4 / 3 * np.pi * 0.125, 0.03),
    ],
)
def test_triangles_enclose_the_shape(kind, size, expected, off):
    shape = Shape("it", kind, "base", np.array([1.0, 2.0, 3.0]), np.eye(3)[[1, 2, 0]], np.array(size))
    vertices, faces = triangles(shape_faces(shape))
    assert volume(vertices - [1.0, 2.0, 3.0], faces) == pytest.approx(expected, rel=off)


def test_edges_are_sharp_and_round_surfaces_are_not():
    box, _ = triangles(shape_faces(Shape("b", BOX, "base", np.zeros(3), np.eye(3), np.ones(3))))
    assert len(box) == 24  # three normals at each of eight corners
    ball, faces = triangles(shape_faces(Shape("s", SPHERE, "base", np.zeros(3), np.eye(3), np.ones(1))))
    assert len(np.unique(np.round(ball, 6), axis=0)) == len(ball)
    # Closed, and without a hole: Euler's formula.
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    assert len(ball) - len(edges) + len(faces) == 2


def test_several_meshes_are_one():
    box = triangles(shape_faces(Shape("b", BOX, "base", np.zeros(3), np.eye(3), np.ones(3))))
    rod = triangles(cylinder_between(np.array([5.0, 0, 0]), np.array([5.0, 2.0, 0]), 0.5))
    vertices, faces = merged([box, rod])
    assert volume(vertices, faces) == pytest.approx(volume(*box) + volume(*rod))
    assert vertices[:, 0].max() == pytest.approx(5.5)


def test_colours_warn_before_the_limit():
    own = (0.1, 0.2, 0.3)
    assert warned(own, 0.0) == warned(own, 0.7) == own
    assert warned(own, 0.85) == pytest.approx(NEAR)
    assert warned(own, 1.0) == warned(own, 1.3) == pytest.approx(AT)
    assert warned(own, np.nan) == warned(own, np.inf) == AT
    reds = [warned(own, nearness)[0] - warned(own, nearness)[2] for nearness in np.linspace(0.7, 0.85, 9)]
    assert np.all(np.diff(reds) >= 0)


def test_frames_span_the_whole_motion():
    time = np.sort(np.random.default_rng(0).uniform(0.0, 60.0, 5000))
    chosen = chosen_samples(time)
    assert len(chosen) <= FRAMES
    assert (chosen[0], chosen[-1]) == (0, 4999)
    assert np.all(np.diff(chosen) > 0)
    assert np.diff(time[chosen]).max() < 2 * 60.0 / (FRAMES - 1)
    assert chosen_samples(time[:7]).tolist() == list(range(7))
    assert frames_each(1) == FRAMES > frames_each(12) >= 90


@pytest.mark.parametrize("count", [1, 2, 3, 5, 9])
def test_replays_stand_beside_each_other_and_all_are_seen(count):
    replays = [boxes_replay(str(number)) for number in range(count)]
    shifts, view = places(replays), view_of(replays)
    ahead = view.look_at - view.position
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, view.up)
    right = right / np.linalg.norm(right)
    up = np.cross(right, ahead)

    def inside(points):
        away = points - view.position
        depth = away @ ahead
        half = np.tan(0.5 * view.fov)
        assert np.all(depth > 0)
        assert np.all(np.abs(away @ up) <= half * depth)
        assert np.all(np.abs(away @ right) <= 1.2 * half * depth)

    low, high = replays[0].extent()
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * (high - low) + low
    seen = []
    for shift in shifts:
        for solid in replays[0].solids:
            turn = Rotation.from_quat(solid.quaternion, scalar_first=True).as_matrix()
            moved = np.einsum("fij,vj->fvi", turn, solid.vertices) + solid.position[:, None]
            inside(moved.reshape(-1, 3) + shift)
        for way in replays[0].ways:
            inside(way.points + shift)
        away = corners + shift - view.position
        # In parallel projection, that their places are not before each other.
        seen.append([(away @ right).min(), (away @ right).max(), (away @ up).min(), (away @ up).max()])
    for one in range(count):
        for other in range(one):
            a, b = seen[one], seen[other]
            assert a[1] <= b[0] or b[1] <= a[0] or a[3] <= b[2] or b[3] <= a[2]
