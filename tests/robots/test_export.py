"""What is written reads back as the same robot, by this package and by MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from mujoco_reference import MujocoReference, evaluate, random_state
from robot_texts import DATA, MJCF, URDF, cube_stl

import jffsr
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.description import (
    EndEffectorDescription,
    JointDescription,
    LinkDescription,
    RobotDescription,
)
from jffsr.robots.formats.rpy import matrix_to_quaternion, matrix_to_rpy, quaternion_to_matrix, rpy_to_matrix
from jffsr.robots.geometry import Shape

NAMES = [*jffsr.list_robots(), "two_arms", "tree_prismatic"]
# A published arm, two arms with and without shapes, and joints that slide; the others have nothing that these lack.
NOW = {"wu_2018_6dof", "dual_arm_servicer", "two_arms", "tree_prismatic"}
SUFFIXES = [".urdf", ".xml", ".mjcf"]


def load(name):
    return jffsr.load_robot(name if name in jffsr.list_robots() else DATA / "robots" / f"{name}.yaml")


def assert_same_robot(ours, theirs, inertia=1e-12):
    assert ours.topology == theirs.topology
    for seed in range(2):
        state = random_state(ours, seed)
        (found, found_poses), (expected, poses) = evaluate(ours, state), evaluate(theirs, state)
        np.testing.assert_allclose(found, expected, rtol=0, atol=inertia * np.abs(expected).max())
        for tool, pose in poses.items():
            for a, b in zip(found_poses[tool], pose, strict=True):
                np.testing.assert_allclose(a, b, rtol=0, atol=1e-12)
    for name, limit in vars(theirs.limits).items():
        np.testing.assert_array_equal(getattr(ours.limits, name), limit, err_msg=name)
    np.testing.assert_allclose(ours.root_position, theirs.root_position, rtol=0, atol=1e-15)


@pytest.mark.parametrize("suffix", SUFFIXES[:2])
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in NOW else [pytest.mark.slow]) for name in NAMES]
)
def test_a_robot_reads_back_as_it_was(name, suffix, tmp_path):
    robot = load(name)
    path = tmp_path / f"robot{suffix}"
    path.write_text(jffsr.to_urdf(robot) if suffix == ".urdf" else jffsr.to_mjcf(robot), encoding="utf-8")
    assert_same_robot(jffsr.load_robot(path), robot)


@pytest.mark.parametrize("suffix", SUFFIXES[:2])
@pytest.mark.parametrize("name", ["wu_2018_6dof", "two_arms", "tree_prismatic"])
def test_mujoco_reads_the_same_robot(name, suffix, tmp_path):
    robot = load(name)
    path = tmp_path / f"robot{suffix}"
    jffsr.save_robot(robot, path)
    reference = MujocoReference(path)
    for seed in range(3):
        state = random_state(robot, seed)
        reference.set(robot, state)
        expected = reference.inertia()
        found, poses = evaluate(robot, state)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    if suffix == ".xml":
        motors = [reference.model.actuator(i).name for i in range(reference.model.nu)]
        assert motors == list(robot.joint_names)
        for tool in robot.end_effector_names:
            position, quaternion = poses[tool]
            place, rotation = reference.site(tool)
            np.testing.assert_allclose(place, position, rtol=0, atol=1e-12)
            np.testing.assert_allclose(rotation, quaternion_to_matrix(quaternion), rtol=0, atol=1e-12)


def test_roll_pitch_and_yaw_are_exact_at_every_rotation():
    """Among them pitches so close to 90 degrees that yaw alone says little."""
    rng = np.random.default_rng(3)
    angles = [rng.uniform(-np.pi, np.pi, 3) for _ in range(200)]
    for offset in (0.0, 1e-15, 1e-12, 1e-9, 1e-8, 1e-6, 1e-3):
        for sign in (-1, 1):
            angles.append([rng.uniform(-3, 3), sign * (np.pi / 2 - offset), rng.uniform(-3, 3)])
    angles += [
        [a * np.pi / 2, b * np.pi / 2, c * np.pi / 2] for a in range(4) for b in range(4) for c in range(4)
    ]
    for rpy in angles:
        rotation = rpy_to_matrix(rpy)
        np.testing.assert_allclose(rpy_to_matrix(matrix_to_rpy(rotation)), rotation, rtol=0, atol=1e-15)
        again = quaternion_to_matrix(matrix_to_quaternion(rotation))
        np.testing.assert_allclose(again, rotation, rtol=0, atol=1e-15)
    # By its definition: about the fixed axes x, y, z, one after the other.
    c, s = np.cos(0.3), np.sin(0.3)
    np.testing.assert_allclose(
        rpy_to_matrix((0.3, 0, 0)), [[1, 0, 0], [0, c, -s], [0, s, c]], rtol=0, atol=1e-16
    )
    np.testing.assert_allclose(
        rpy_to_matrix((0, 0.3, 0)), [[c, 0, s], [0, 1, 0], [-s, 0, c]], rtol=0, atol=1e-16
    )
    np.testing.assert_array_equal(
        rpy_to_matrix((np.pi / 2, 0.0, np.pi / 2)), [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    )


def limited(**limits):
    """A robot with a turning and a sliding joint of given limits."""
    links = [LinkDescription(name, 2.0, np.array([0.1, 0, 0.2]), np.eye(3)) for name in ("base", "a", "b")]
    joints = [
        JointDescription(
            "turn", "revolute", "base", "a", np.ones(3), np.eye(3), np.array([0.0, 0, 1]), **limits
        ),
        JointDescription(
            "slide", "prismatic", "a", "b", np.ones(3), np.eye(3), np.array([0.0, 1, 0]), **limits
        ),
    ]
    tools = (EndEffectorDescription("b", "b", np.array([0, 0, 0.3]), np.eye(3)),)
    return build_robot(RobotDescription("limited", "test", tuple(links), tuple(joints), tools))


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize(
    "limits",
    [
        {},
        {"position_limit": (-0.1, 0.7), "velocity_limit": 0.3, "acceleration_limit": 1 / 3, "torque_limit": 5.0},
        {"position_limit": (-np.inf, 0.7), "velocity_limit": 0.3},
        {"position_limit": (0.0, np.inf), "torque_limit": 0.1},
        {"acceleration_limit": 0.2},
    ],
)  # fmt: skip
def test_limits_read_back_as_they_were(limits, suffix, tmp_path):
    robot = limited(**limits)
    jffsr.save_robot(robot, tmp_path / f"robot{suffix}")
    found = jffsr.load_robot(tmp_path / f"robot{suffix}").limits
    for name, limit in vars(robot.limits).items():
        np.testing.assert_array_equal(getattr(found, name), limit, err_msg=name)


def test_an_end_effector_may_bear_a_bodys_name(tmp_path):
    """In URDF both are links, so that the body gives way; in MJCF a site and a body may share a name."""
    robot = limited()
    for suffix, bodies in ((".urdf", ("base", "a", "b_link")), (".xml", ("base", "a", "b"))):
        jffsr.save_robot(robot, tmp_path / f"robot{suffix}")
        found = jffsr.load_robot(tmp_path / f"robot{suffix}")
        assert found.body_names == bodies
        assert found.end_effector_names == ("b",)
        np.testing.assert_array_equal(found.end_effector_position, robot.end_effector_position)


def test_a_urdf_whose_tools_are_its_leaf_links_reads_back(tmp_path):
    robot = limited().replace(end_effector_position=np.zeros((1, 3)))
    jffsr.save_robot(robot, tmp_path / "robot.urdf")
    assert 'name="b_link"' not in (tmp_path / "robot.urdf").read_text()
    assert_same_robot(jffsr.load_robot(tmp_path / "robot.urdf"), robot)


def test_joints_and_tools_keep_an_order_that_is_not_that_of_the_bodies(tmp_path):
    """Two arms grown in turns: both files have the joints and tools as the robot has them."""
    names = ["base", "a1", "b1", "a2", "b2"]
    links = [
        LinkDescription(name, 2.0 + i, np.array([0.1 * i, 0, 0.2]), np.eye(3)) for i, name in enumerate(names)
    ]
    joints = [
        JointDescription(
            f"to_{child}", "revolute", parent, child, np.ones(3), np.eye(3), np.array([0.0, 0, 1])
        )
        for parent, child in (("base", "a1"), ("base", "b1"), ("a1", "a2"), ("b1", "b2"))
    ]
    tools = [
        EndEffectorDescription(f"on_{name}", name, np.ones(3), np.eye(3)) for name in ("b2", "base", "a1")
    ]
    robot = build_robot(RobotDescription("turns", "test", tuple(links), tuple(joints), tuple(tools)))
    for suffix in SUFFIXES[:2]:
        jffsr.save_robot(robot, tmp_path / f"robot{suffix}")
        assert_same_robot(jffsr.load_robot(tmp_path / f"robot{suffix}"), robot)


def test_names_that_xml_escapes(tmp_path):
    robot = limited()
    odd = ('<a> & "b"', "c'd é\t")
    topology = robot.topology.__class__(**{**vars(robot.topology), "name": "x\x00y", "joint_names": odd})
    robot = robot.replace(topology=topology)
    for suffix in SUFFIXES[:2]:
        jffsr.save_robot(robot, tmp_path / f"robot{suffix}")
        found = jffsr.load_robot(tmp_path / f"robot{suffix}")
        assert found.name == "x_y"
        assert found.joint_names == ('<a> & "b"', "c'd é_")


@pytest.fixture
def decorated(tmp_path):
    """The realistic URDF and MJCF, with meshes, as robots."""
    folder = tmp_path / "from"
    (folder / "satellite_description" / "meshes").mkdir(parents=True)
    (folder / "meshes").mkdir()
    (folder / "satellite_description" / "meshes" / "shoulder.stl").write_bytes(cube_stl())
    (folder / "meshes" / "box.stl").write_bytes(cube_stl())
    (folder / "a.urdf").write_text(URDF, encoding="utf-8")
    (folder / "a.xml").write_text(MJCF, encoding="utf-8")
    return jffsr.load_robot(folder / "a.urdf"), jffsr.load_robot(folder / "a.xml")


def assert_same_shapes(ours, theirs):
    assert [(s.kind, s.body, s.roles, s.colour) for s in ours] == [
        (s.kind, s.body, s.roles, s.colour) for s in theirs
    ]
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a.position, b.position, rtol=0, atol=1e-6)
        np.testing.assert_allclose(a.size, b.size, rtol=1e-15)
        np.testing.assert_allclose(a.rotation, b.rotation, rtol=0, atol=1e-6)
        if b.kind == "mesh":
            assert len(a.faces) == len(b.faces)
            found = sorted(map(tuple, np.round(a.vertices, 5)))
            np.testing.assert_allclose(found, sorted(map(tuple, np.round(b.vertices, 5))), atol=1e-5)


def test_mjcf_keeps_every_shape(decorated, tmp_path):
    for robot in decorated:
        path = tmp_path / "saved.xml"
        jffsr.save_robot(robot, path)
        found = jffsr.load_robot(path)
        assert_same_robot(found, robot)
        assert_same_shapes(found.geometry.shapes, robot.geometry.shapes)
    assert [file.name for file in tmp_path.iterdir() if file.is_file()] == ["saved.xml"]


def test_urdf_keeps_boxes_and_meshes(decorated, tmp_path):
    satellite, _ = decorated
    path = tmp_path / "saved.urdf"
    jffsr.save_robot(satellite, path)
    found = jffsr.load_robot(path)
    assert_same_robot(found, satellite)
    assert_same_shapes(found.geometry.shapes, satellite.geometry.shapes)
    assert [file.name for file in (tmp_path / "saved_meshes").iterdir()] == ["shoulder_visual_0.obj"]


def test_urdf_text_says_what_it_leaves_out(decorated):
    """A capsule is a cylinder with a ball at each end; an ellipsoid and meshes go, with a comment."""
    _, two_armed = decorated
    text = jffsr.to_urdf(two_armed)
    for kind, count in (("mesh", 2), ("ellipsoid", 1)):
        assert text.count(f"<!-- left out: {kind} ") == count
    links = {link.get("name"): link for link in ET.fromstring(text).iter("link")}
    upper = [collision.find("geometry")[0] for collision in links["left_upper"].iter("collision")]
    assert [solid.tag for solid in upper] == ["cylinder", "sphere", "sphere"]
    length = float(upper[0].get("length"))
    assert length == pytest.approx(np.hypot(0.6, 0.1))
    ends = [
        np.array(c.find("origin").get("xyz").split(), float) for c in links["left_upper"].iter("collision")
    ][1:]
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(length)
    # The capsule's ends as the file states them, in a frame moved to the joint.
    corner = np.array([0.1, 0.02, -0.03])
    found = sorted(map(tuple, np.array(ends) + corner))
    np.testing.assert_allclose(found, [(0, 0, 0), (0, 0.6, 0.1)], rtol=0, atol=1e-12)


def test_a_flat_mesh_and_odd_names_can_be_saved(tmp_path):
    """It has no volume, and its name is no file name."""
    robot = limited()
    triangle = Shape(
        "../panel: a/b", "mesh", "a", np.zeros(3), np.eye(3),
        vertices=np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [1, 2, 0]]), faces=np.array([[0, 1, 2], [1, 3, 2]]),
    )  # fmt: skip
    robot = robot.replace(geometry=robot.geometry.__class__((triangle,)))
    jffsr.save_robot(robot, tmp_path / "flat.urdf")
    shape, again = jffsr.load_robot(tmp_path / "flat.urdf").geometry.shapes
    assert (shape.roles, again.roles) == (("visual",), ("collision",))
    np.testing.assert_allclose(
        sorted(map(tuple, shape.vertices)), sorted(map(tuple, triangle.vertices)), atol=1e-6
    )
    assert sorted(file.name for file in tmp_path.rglob("*")) == [
        ".._panel__a_b.obj",
        "flat.urdf",
        "flat_meshes",
    ]


def test_saving_refuses_what_it_cannot_do(tmp_path):
    robot = limited()
    with pytest.raises(InputError, match=r"a\.sdf: a robot is saved as \.urdf \(URDF\), or \.xml or \.mjcf"):
        jffsr.save_robot(robot, tmp_path / "a.sdf")
    with pytest.raises(InputError, match=r"a\.urdf: the file cannot be written \(no such file"):
        jffsr.save_robot(robot, tmp_path / "gone" / "a.urdf")
    (tmp_path / "kept.urdf").mkdir()
    with pytest.raises(InputError, match=r"kept\.urdf: the file cannot be written"):
        jffsr.save_robot(robot, tmp_path / "kept.urdf")
    assert [file.name for file in tmp_path.iterdir()] == ["kept.urdf"]
