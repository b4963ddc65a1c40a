"""MJCF: classes, frames, angles, meshes and geoms against MuJoCo's own mass matrix; conventions; leaving out."""

from __future__ import annotations

import chex
import mujoco
import numpy as np
import pytest
from mujoco_reference import MujocoReference, assert_same_inertia, random_state
from robot_texts import CUBE, MJCF, cube_obj, cube_stl

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.loading import describe_robot, load_robot
from jffsr.spatial.rotation import quaternion_to_matrix

INERTIAL = '<inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>'


def body(name, inside="", inertial=INERTIAL, attributes=""):
    return f'<body name="{name}" {attributes}>{inertial}{inside}</body>'


def write(folder, worldbody, before="", name="arm.xml"):
    path = folder / name
    path.write_text(
        f"<mujoco>\n{before}\n<worldbody>\n{worldbody}\n</worldbody>\n</mujoco>\n", encoding="utf-8"
    )
    return path


@pytest.fixture
def two_armed(tmp_path):
    """The realistic file with its mesh beside it."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "box.stl").write_bytes(cube_stl())
    # MuJoCo itself, the reference, would miss the texture.
    (tmp_path / "reference.xml").write_text(
        MJCF.replace('file="foil_that_is_not_there.png"', 'builtin="flat" width="8" height="8"'),
        encoding="utf-8",
    )
    path = tmp_path / "two_armed.xml"
    path.write_text(MJCF, encoding="utf-8")
    return path


def test_a_realistic_file_is_read_whole(two_armed):
    robot = load_robot(two_armed)
    assert robot.name == "two_armed"
    assert robot.body_names == ("bus", "left_upper", "left_lower", "right_upper", "right_lower")
    assert robot.joint_names == ("left_shoulder", "left_elbow", "right_slide", "right_wrist")
    assert robot.topology.joint_types == ("revolute", "revolute", "prismatic", "revolute")
    assert robot.topology.parents == (0, 1, 0, 3)
    assert robot.end_effector_names == ("left_tool", "right_tool")
    limits = robot.limits
    degrees = np.pi / 180
    np.testing.assert_allclose(limits.position_lower, [-90 * degrees, -2 * degrees, 0, -np.inf], rtol=1e-15)
    np.testing.assert_allclose(limits.position_upper, [120 * degrees, 2 * degrees, 0.4, np.inf], rtol=1e-15)
    np.testing.assert_array_equal(limits.torque, [np.inf, 20, np.inf, np.inf])
    # The tensor in the text comes through exactly, not by way of principal axes.
    np.testing.assert_array_equal(robot.inertia[0], [[6, 0.3, -0.2], [0.3, 7, 0.1], [-0.2, 0.1, 8]])


def test_a_realistic_file_has_mujocos_mass_matrix_and_sites(two_armed):
    robot = load_robot(two_armed)
    reference = assert_same_inertia(two_armed.with_name("reference.xml"), robot)
    state = random_state(robot, 5)
    reference.set(robot, state)
    kin = kinematics(robot, state)
    for tool in robot.end_effector_names:
        position, quaternion = end_effector_pose(robot, kin, tool)
        expected_position, expected_rotation = reference.site(tool)
        np.testing.assert_allclose(position, expected_position, rtol=0, atol=1e-12)
        np.testing.assert_allclose(quaternion_to_matrix(quaternion), expected_rotation, rtol=0, atol=1e-12)


def test_shapes_stand_where_mujoco_puts_them(two_armed):
    robot = load_robot(two_armed)
    reference = MujocoReference(two_armed.with_name("reference.xml"))
    state = random_state(robot, 11)
    reference.set(robot, state)
    kin = kinematics(robot, state)
    model, data = reference.model, reference.data
    geoms = [i for i in range(model.ngeom) if model.geom_bodyid[i] != 0]
    assert len(geoms) == len(robot.geometry.shapes) == 7
    rotations, origins = np.asarray(kin.rotation), np.asarray(kin.origin)
    for geom, shape in zip(geoms, robot.geometry.shapes, strict=True):
        index = robot.body_names.index(shape.body)
        points = np.zeros((1, 3)) if shape.vertices is None else shape.vertices
        mesh = model.geom_dataid[geom]
        theirs = np.zeros((1, 3))
        if mesh >= 0:
            theirs = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
            # In the file's own frame, at half its height: not as MuJoCo turns and centres it.
            found = np.array(sorted(map(tuple, np.round(points, 6))))
            np.testing.assert_allclose(found, sorted((x, y, z / 2) for x, y, z in CUBE), atol=1e-6)
        ours = origins[index] + (shape.position + points @ shape.rotation.T) @ rotations[index].T
        theirs = data.geom_xpos[geom] + theirs @ data.geom_xmat[geom].reshape(3, 3).T
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-6)


def test_roles_and_colours(two_armed):
    shapes = load_robot(two_armed).geometry.shapes
    assert [shape.kind for shape in shapes] == [
        "mesh",
        "box",
        "capsule",
        "box",
        "cylinder",
        "mesh",
        "ellipsoid",
    ]
    both = ("visual", "collision")
    assert [s.roles for s in shapes] == [("visual",), both, both, ("collision",), both, both, both]
    assert shapes[0].colour == (0.9, 0.8, 0.1, 1.0)
    assert shapes[1].colour is None
    assert shapes[2].colour == (0.2, 0.4, 0.6, 1.0)


def test_what_is_left_out_is_said(two_armed):
    notes = describe_robot(two_armed).notes
    assert "joint 'left_elbow': damping 0.3 is left out" in notes
    assert "joint 'left_elbow': armature 0.02 is left out" in notes
    assert "joint 'left_elbow': of the forces [-30, 20] the smaller is the limit" in notes


def test_the_pose_of_the_top_body_is_kept_apart(two_armed):
    """A robot has no pose, a state has: the file's is in the description."""
    extra = describe_robot(two_armed).extra
    model = mujoco.MjModel.from_xml_path(str(two_armed.with_name("reference.xml")))
    np.testing.assert_allclose(extra["root_position"], model.body("bus").pos, rtol=0, atol=1e-15)
    np.testing.assert_allclose(extra["root_quaternion"], model.body("bus").quat, rtol=0, atol=1e-15)
    moved = two_armed.with_name("moved.xml")
    moved.write_text(MJCF.replace('name="bus" pos="0.5 0 0"', 'name="bus" pos="7 8 9"'), encoding="utf-8")
    chex.assert_trees_all_equal(load_robot(moved), load_robot(two_armed))


def test_the_free_joint_may_be_absent(two_armed):
    bare = two_armed.with_name("bare.xml")
    bare.write_text(MJCF.replace("<freejoint/>", ""), encoding="utf-8")
    chex.assert_trees_all_equal(load_robot(bare), load_robot(two_armed))


def test_static_fusing_loses_nothing(tmp_path):
    """A file that asks MuJoCo to fuse fixed bodies keeps the mass of its base."""
    text = body("base", body("mast") + body("arm", '<joint name="j"/>'))
    plain = load_robot(write(tmp_path, text))
    fused = load_robot(write(tmp_path, text, '<compiler fusestatic="true" discardvisual="true"/>'))
    assert plain.mass.tolist() == [4, 2]
    chex.assert_trees_all_equal(fused, plain)


def test_included_files_are_read(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xml").write_text(
        "<mujocoinclude>" + body("arm", '<joint name="j"/>') + "</mujocoinclude>"
    )
    path = write(tmp_path, body("base", '<include file="parts/arm.xml"/>'))
    assert load_robot(path).body_names == ("base", "arm")
    assert_same_inertia(path, load_robot(path))


def test_a_stated_inertia_yields_to_what_the_compiler_is_told(tmp_path):
    """Where MuJoCo is asked to raise small moments or to take inertias from geoms, its compiled numbers hold."""
    inertial = '<inertial pos="0 0 0" mass="2" fullinertia="1 1.1 1.2 0.1 0.2 0.3"/>'
    text = body("base", body("arm", '<joint name="j"/><geom size="0.1 0.2 0.3" type="box"/>'), inertial)
    scaled = write(tmp_path, text, '<compiler boundinertia="0.9"/>')
    robot = load_robot(scaled)
    assert np.linalg.eigvalsh(robot.inertia[0])[0] == pytest.approx(0.9)
    assert_same_inertia(scaled, robot)
    deprecated = write(tmp_path, text, '<compiler settotalmass="8"/>', name="total.xml")
    np.testing.assert_allclose(load_robot(deprecated).mass, [4, 4], rtol=1e-14)
    assert "MuJoCo says: compiler attribute 'settotalmass' is deprecated" in describe_robot(deprecated).notes
    geoms = write(tmp_path, text, '<compiler inertiafromgeom="true"/>', name="geoms.xml")
    robot = load_robot(geoms)
    np.testing.assert_allclose(robot.mass, [2, 1000 * 0.2 * 0.4 * 0.6], rtol=1e-14)
    assert_same_inertia(geoms, robot)


def test_bodies_and_joints_without_names(tmp_path):
    inner = f"<body>{INERTIAL}<joint/><body>{INERTIAL}<joint type='slide'/></body></body>"
    robot = load_robot(write(tmp_path, f"<body>{INERTIAL}{inner}</body>"))
    assert robot.body_names == ("body_1", "body_2", "body_3")
    assert robot.joint_names == ("joint_0", "joint_1")
    assert robot.end_effector_names == ("body_3",)


def test_end_effectors_are_sites_in_the_order_of_the_text(tmp_path):
    arm = body("arm", '<joint name="j"/><site name="second"/>')
    robot = load_robot(write(tmp_path, body("base", arm + '<site name="third" pos="0 0 1"/>')))
    assert robot.end_effector_names == ("second", "third")
    leaf = body("arm", '<joint name="j"/>' + body("hand", inertial=""))
    assert load_robot(write(tmp_path, body("base", leaf))).end_effector_names == ("hand",)


def test_an_inline_mesh_and_an_obj(tmp_path):
    (tmp_path / "box.obj").write_text(cube_obj())
    vertices = " ".join(f"{x} {y} {z}" for x, y, z in CUBE)
    asset = f'<asset><mesh file="box.obj"/><mesh name="inline" vertex="{vertices}"/></asset>'
    geoms = '<geom type="mesh" mesh="box" density="500"/><geom type="mesh" mesh="inline" density="500"/>'
    path = write(tmp_path, body("base", body("arm", '<joint name="j"/>' + geoms, inertial="")), asset)
    robot = load_robot(path)
    # Twice half the density of water in 0.02 m^3.
    np.testing.assert_allclose(robot.mass[1], 2 * 500 * 0.2 * 0.5 * 0.2, rtol=1e-6)
    assert_same_inertia(path, robot)
    assert [shape.kind for shape in robot.geometry.shapes] == ["mesh", "mesh"]


def test_a_missing_mesh_is_left_out_only_where_it_just_draws(two_armed):
    (two_armed.parent / "meshes" / "box.stl").unlink()
    with pytest.raises(
        InputError, match=r"body 'right_upper': its inertia comes from its geoms, and mesh 'box': "
    ):
        load_robot(two_armed)
    drawn = two_armed.with_name("drawn.xml")
    drawn.write_text(MJCF.replace('<geom type="mesh" mesh="box" mass="3"/>', '<geom size="0.1 0.1"/>'))
    robot = load_robot(drawn)
    assert "mesh 'box' is left out: box.stl: there is no such file" in describe_robot(drawn).notes
    assert [s.kind for s in robot.geometry.on_body("bus")] == ["box"]


def test_a_thin_plate_is_no_impossible_body(tmp_path):
    """The triangle inequality may hold with equality."""
    plate = '<inertial pos="0 0 0" mass="2" diaginertia="1 2 3"/>'
    path = write(tmp_path, body("base", body("arm", '<joint name="j"/>', plate)))
    np.testing.assert_array_equal(np.diagonal(load_robot(path).inertia[1]), [1, 2, 3])
