"""One robot standing still: solids are the shapes of the file, stand where the kinematics says, and are named."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from jffsr import cli
from jffsr.errors import InputError
from jffsr.robots.geometry import Geometry, Shape
from jffsr.robots.loading import list_robots
from jffsr.viz.replay.bodies import bare_parts
from jffsr.viz.robot import draw_still, solids_of
from jffsr.viz.scene import scene_at
from jffsr.viz.solids import outward, refined, shape_faces

# A regular polygon of 24 corners covers this share of its circle.
AROUND = 24 / (2 * np.pi) * np.sin(2 * np.pi / 24)


# A planar one, a folded and an open arm, two arms, and the shapeless tree.
NOW = {"hu_2011_planar2", "canadarm2_7dof", "ets7_6dof", "dual_arm_servicer", "two_arms"}
some = pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in NOW else [pytest.mark.slow])
        for name in (*list_robots(), "two_arms")
    ],
)


@pytest.fixture(scope="module")
def stills(robots):
    """Drawings by the robot's name, each made once."""
    return cache(lambda name: draw_still(robots[name]))


def shape(kind, size=(), **more):
    return Shape(kind, kind, "base", np.zeros(3), np.eye(3), np.array(size, float), **more)


def volume(faces):
    """Volume inside closed faces (f, 4, 3), positive where they look outwards: sums of signed tetrahedra."""
    a, b, c, d = np.moveaxis(faces, 1, 0)
    return (np.einsum("fi,fi->f", a, np.cross(b, c)) + np.einsum("fi,fi->f", a, np.cross(c, d))).sum() / 6


@pytest.mark.parametrize(
    ("kind", "size", "expected", "rtol"),
    [
        ("box", [0.1, 0.2, 0.3], 8 * 0.006, 1e-12),
        ("cylinder", [0.2, 0.5], np.pi * 0.04 * AROUND, 1e-12),
        ("sphere", [0.3], 4 / 3 * np.pi * 0.027, 0.03),
        ("ellipsoid", [0.1, 0.2, 0.3], 4 / 3 * np.pi * 0.006, 0.03),
        ("capsule", [0.2, 0.5], np.pi * 0.04 + 4 / 3 * np.pi * 0.008, 0.03),
    ],
)
def test_faces_close_around_the_shapes_volume(kind, size, expected, rtol):
    faces = shape_faces(shape(kind, size))
    np.testing.assert_allclose(volume(faces), expected, rtol=rtol)
    assert np.all(np.einsum("fi,fi->f", faces.mean(axis=1), outward(faces)) > 0)
    # Cut finer, the same surface.
    fine = refined(faces, 0.05)
    assert len(fine) > len(faces)
    np.testing.assert_allclose(volume(fine), volume(faces), rtol=1e-12)
    assert np.linalg.norm(fine[:, 1] - fine[:, 0], axis=1).max() < 0.05 + 1e-12


def test_a_placed_shape_is_turned_and_moved():
    turned = Shape(
        "s", "cylinder", "base", np.array([1.0, 2, 3]), np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
        np.array([0.1, 0.4]),
    )  # fmt: skip
    points = shape_faces(turned).reshape(-1, 3)
    np.testing.assert_allclose(points.min(axis=0), [0.6, 1.9, 2.9], atol=1e-12)
    np.testing.assert_allclose(points.max(axis=0), [1.4, 2.1, 3.1], atol=1e-12)


def test_a_mesh_is_drawn_as_it_is_and_a_large_one_as_its_hull():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    triangles = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    faces = shape_faces(shape("mesh", vertices=corners, faces=triangles))
    np.testing.assert_array_equal(faces[:, :3], corners[triangles])
    np.testing.assert_allclose(volume(faces), 1 / 6)

    rng = np.random.default_rng(0)
    points = rng.normal(size=(900, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    tangle = np.concatenate([rng.integers(0, 900, size=(4997, 3)), 4 * [[0, 1, 2]]])
    hull = shape_faces(shape("mesh", vertices=points, faces=tangle))
    assert len(hull) < 1800
    assert 0.95 * 4 / 3 * np.pi < volume(hull) < 4 / 3 * np.pi
    assert {tuple(p) for p in hull.reshape(-1, 3)} <= {tuple(p) for p in points}


def test_solids_stand_where_the_published_pose_puts_them(robots):
    """servicer_7dof at the start pose of Wang et al. 2021: the gripper lies behind the printed tool, unturned."""
    robot = robots["servicer_7dof"]
    scene = scene_at(robot, np.deg2rad([[0.0, -60, 0, 45, 0, -15, 0]]))
    solids = [faces for faces, *_ in solids_of(robot, scene, 0)]
    gripper = solids[-1].reshape(-1, 3)
    tool = np.array([1.078, 0.252, -1.853])
    np.testing.assert_allclose(gripper.max(axis=0), np.add(tool, [0, 0.06, 0.04]), atol=1e-9)
    np.testing.assert_allclose(gripper.min(axis=0), np.subtract(tool, [0.1, 0.06, 0.04]), atol=1e-9)
    base = solids[0].reshape(-1, 3)
    np.testing.assert_allclose(np.abs(base), np.broadcast_to([0.8, 0.8, 0.75], base.shape))


def test_solids_of_wu_end_at_the_published_tool(robots):
    robot = robots["wu_2018_6dof"]
    scene = scene_at(robot, np.deg2rad([[175.0, -60, -60, 0, 210, 5]]))
    hand = solids_of(robot, scene, 0)[-1][0].reshape(-1, 3)
    assert np.linalg.norm(hand - [1.37, -0.08, 0.64], axis=1).min() < 0.1
    assert np.linalg.norm(hand.mean(axis=0) - [1.37, -0.08, 0.64]) < 0.06


@some
def test_every_robot_is_drawn_whole_and_its_joints_are_named(name, robots, stills):
    robot, still = robots[name], stills(name)
    figure = still.figure
    figure.canvas.draw()
    axes = figure.axes[0]
    scene = scene_at(robot, still.posture[None])
    limits = [axes.get_xlim(), axes.get_ylim()] + ([axes.get_zlim()] if axes.name == "3d" else [])
    points = np.concatenate([faces.reshape(-1, 3) for faces, *_ in solids_of(robot, scene, 0)])
    points = np.concatenate([points, scene.joints[0], scene.tools[0], scene.com])
    for coordinate, (low, high) in zip(points.T, limits, strict=False):
        assert low < coordinate.min() < coordinate.max() < high

    if axes.name == "3d":
        spans = np.ptp(limits, axis=1)
        np.testing.assert_allclose(axes.get_box_aspect() / spans, axes.get_box_aspect()[0] / spans[0])
    else:
        assert axes.get_aspect() == 1.0
    texts = [text for text in (*figure.texts, *axes.texts) if text.get_text()]
    assert sorted(text.get_text() for text in texts) == sorted(robot.joint_names)
    boxes = [text.get_window_extent() for text in texts]
    for i, box in enumerate(boxes):
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= figure.bbox.x1
        assert box.y1 <= figure.legends[0].get_window_extent().y0
        assert not any(box.overlaps(other) for other in boxes[:i])


@some
def test_the_default_posture_keeps_the_limits(name, robots, stills):
    limits, posture = robots[name].limits, stills(name).posture
    assert np.all(posture >= limits.position_lower)
    assert np.all(posture <= limits.position_upper)


def test_a_folded_arm_is_opened_and_an_open_one_left_as_it_is(robots, stills):
    np.testing.assert_array_equal(stills("ets7_6dof").posture, 0.0)
    # At zero the second boom lies beside the first.
    robot, posture = robots["canadarm2_7dof"], stills("canadarm2_7dof").posture
    scene = scene_at(robot, np.stack([0 * posture, posture]))
    folded, opened = np.linalg.norm(scene.tools[:, 0] - scene.joints[:, 0], axis=1)
    assert folded < 3
    assert opened > 9


def test_a_robot_without_shapes_is_its_box_and_round_links(robots):
    robot = robots["two_arms"]
    assert not robot.geometry.shapes
    scene = scene_at(robot, np.zeros((1, robot.num_joints)))
    solids = [faces for faces, *_ in solids_of(robot, scene, 0)]
    np.testing.assert_allclose(solids[0], scene.base_faces[0], atol=1e-12)
    middles = [0.5 * (f.reshape(-1, 3).min(axis=0) + f.reshape(-1, 3).max(axis=0)) for f in solids[1:]]

    def drawn_around(points):
        return [np.linalg.norm(np.subtract(middles, point), axis=1).min() < 1e-9 for point in points]

    # A tube's middle is that of a link's line; a housing's is its joint, a disc's its tool.
    starts, ends = np.moveaxis(scene.segments[0], 1, 0)
    long = np.linalg.norm(ends - starts, axis=1) > 0
    assert all(drawn_around(0.5 * (starts + ends)[long]))
    assert all(drawn_around(scene.joints[0]))
    assert all(drawn_around(scene.tools[0]))
    assert len(middles) == long.sum() + robot.num_joints + len(scene.tools[0])


def test_a_heavier_link_without_shapes_is_thicker(robots):
    robot = robots["servicer_7dof"].replace(geometry=Geometry(()))

    def thickness(heavy):
        inertia = np.array(robot.inertia)
        inertia[3] = heavy * inertia[3]
        changed = robot.replace(inertia=inertia)
        scene = scene_at(changed, np.zeros((1, robot.num_joints)))
        (link,) = [part for part in bare_parts(changed, scene) if part.name == f"{robot.body_names[3]} link"]
        return np.sort(np.ptp(link.faces.reshape(-1, 3), axis=0))[0]

    assert thickness(4.0) > 1.2 * thickness(0.25)


@pytest.mark.parametrize("posture", [[0.0, 0.0, 0.0], [np.nan, 0.0]])
def test_a_posture_that_does_not_fit_is_refused(robots, posture):
    with pytest.raises(InputError, match=r"robot 'hu_2011_planar2': .* 2 finite numbers are needed"):
        draw_still(robots["hu_2011_planar2"], posture)


def test_the_command_draws_a_robot(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["robots", "hu_planar2", "--posture=-30,45", "--out", "arm.png"]) == cli.MET
    said = capsys.readouterr().out
    assert "drawn at (-30, 45) deg in arm.png" in said
    assert "Hu, Y. Wang" in said
    assert cli.main(["robots", "ye_planar3"]) == cli.MET
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.png", "ye_2019_planar3.png"]
    for path in tmp_path.iterdir():
        content = path.read_bytes()
        assert content.startswith(b"\x89PNG")
        assert 3000 < len(content) < 80_000


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hu_planar2", "--out", "gone/arm.png"], "'gone/arm.png': the picture cannot be written there"),
        (["hu_planar2", "--out", "arm.svg"], "'arm.svg': a picture is written as .png"),
        (["hu_planar2", "--posture", "1,2,3"], "--posture '1,2,3': robot 'hu_2011_planar2' has 2 joints"),
        (["hu_planar2", "--posture", "1,x"], "--posture '1,x': robot 'hu_2011_planar2' has 2 joints"),
        (["--out", "arm.png"], "--out is for one robot"),
        (["hu_plnar2"], "did you mean 'hu_planar2'?"),
    ],
)
def test_the_command_refuses_in_one_sentence(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["robots", *arguments]) == cli.BAD_INPUT
    output = capsys.readouterr()
    assert said in output.err
    assert output.err.count("\n") == 1
    assert not output.out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("width", [70, 100, 140])
def test_the_listing_fits_the_terminal(width):
    from jffsr.study.catalogue import catalogue_text, robot_text

    listing = catalogue_text(width)
    assert max(map(len, listing.splitlines())) <= width
    assert listing.count("source: ") == len(list_robots())
    prose, _, _ = robot_text("canadarm2", width).partition("\n\n")
    assert max(map(len, prose.splitlines())) <= width
