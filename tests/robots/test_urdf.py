"""URDF: the oracle files to the last bit, a realistic file against MuJoCo, bases, end effectors, refusals."""

from __future__ import annotations

import re

import chex
import jax
import numpy as np
import pytest
from mujoco_reference import assert_same_inertia, random_state
from robot_texts import CUBE, DATA, URDF, cube_stl

from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.errors import InputError
from jffsr.robots.loading import describe_robot, load_robot
from jffsr.spatial.rotation import quaternion_to_matrix

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'


def link(name, inertial=True):
    return f'<link name="{name}">{INERTIAL if inertial else ""}</link>'


def joint(name, parent, child, kind="revolute", inside="", xyz="0 0 0", rpy="0 0 0"):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="0 0 1"/>{inside}</joint>'
    )


def write(folder, *parts, name="arm.urdf"):
    path = folder / name
    path.write_text('<robot name="arm">\n' + "\n".join(parts) + "\n</robot>\n", encoding="utf-8")
    return path


@pytest.fixture
def satellite(tmp_path):
    """The realistic file, with one of its two meshes there, in a package three folders up."""
    meshes = tmp_path / "satellite_description" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "shoulder.stl").write_bytes(cube_stl())
    folder = tmp_path / "satellite_description" / "urdf" / "v1"
    folder.mkdir(parents=True)
    path = folder / "satellite.urdf"
    path.write_text(URDF, encoding="utf-8")
    return path


@pytest.mark.parametrize(("name", "tool"), [("wu6", "tool"), ("planar2", "tip")])
def test_oracle_files_give_the_oracle_robots(oracles, name, tool):
    robot = load_robot(DATA / "oracle" / f"{name}.urdf")
    expected = oracles[name].robot
    assert robot.name == name
    assert robot.body_names[0] == "base"
    assert robot.joint_names == tuple(f"joint{i + 1}" for i in range(expected.num_joints))
    assert robot.end_effector_names == (tool,)
    chex.assert_trees_all_close(robot.replace(limits=None), expected.replace(limits=None), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(robot.limits.position_lower, -6.3)
    np.testing.assert_array_equal(robot.limits.position_upper, 6.3)
    np.testing.assert_array_equal(robot.limits.velocity, 10)
    np.testing.assert_array_equal(robot.limits.torque, 100)
    np.testing.assert_array_equal(robot.limits.acceleration, np.inf)


@pytest.mark.parametrize("name", ["wu6", "planar2"])
def test_oracle_files_have_mujocos_mass_matrix(name):
    path = DATA / "oracle" / f"{name}.urdf"
    assert_same_inertia(path, load_robot(path))


def test_a_realistic_file_is_read_whole(satellite):
    robot = load_robot(satellite)
    assert robot.name == "satellite"
    assert robot.body_names == ("bus", "shoulder", "boom", "wrist")
    assert robot.joint_names == ("j1", "j2", "j3")
    assert robot.topology.joint_types == ("revolute", "revolute", "prismatic")
    assert robot.end_effector_names == ("gripper", "camera")
    assert robot.topology.end_effector_bodies == (3, 0)
    np.testing.assert_allclose(robot.mass, [80, 4, 6.7, 1.2], rtol=1e-15)
    limits = robot.limits
    np.testing.assert_array_equal(limits.position_lower, [-np.inf, -1.5, 0])
    np.testing.assert_array_equal(limits.position_upper, [np.inf, 2, 0.3])
    np.testing.assert_array_equal(limits.velocity, [np.inf, 0.5, np.inf])
    np.testing.assert_array_equal(limits.torque, [np.inf, 40, np.inf])
    np.testing.assert_array_equal(limits.acceleration, [np.inf, 0.8, np.inf])
    np.testing.assert_array_equal(robot.root_position, [-0.02, 0.01, -0.05])


def test_a_realistic_file_has_mujocos_mass_matrix_and_tools(satellite, tmp_path):
    robot = load_robot(satellite)
    # MuJoCo wants every mesh, and has no skipping of a massless root: both go, which changes no dynamics.
    text = re.sub(r"<visual>.*?</visual>", "", URDF).replace('<link name="world"/>', "")
    text = re.sub(r'<joint name="mount".*\n', "", text)
    plain = tmp_path / "plain.urdf"
    plain.write_text(text, encoding="utf-8")
    reference = assert_same_inertia(plain, robot, base="bus")
    state = random_state(robot, 7)
    reference.set(robot, state)
    kin = kinematics(robot, state)
    for tool in ("gripper", "camera"):
        position, quaternion = end_effector_pose(robot, kin, tool)
        expected_position, expected_rotation = reference.body(tool)
        np.testing.assert_allclose(position, expected_position, rtol=0, atol=1e-12)
        np.testing.assert_allclose(quaternion_to_matrix(quaternion), expected_rotation, rtol=0, atol=1e-12)


def test_what_is_left_out_is_said(satellite):
    notes = describe_robot(satellite).notes
    assert "joint 'j1': damping 0.7 is left out" in notes
    assert "joint 'j1': friction 0.2 is left out" in notes
    assert "joint 'j3': effort limit 0 is read as none" in notes
    assert "link 'boom': visual shape left out" in notes
    assert "package://satellite_description/meshes/missing.dae" in notes
    assert describe_robot(DATA / "oracle" / "wu6.urdf").notes == ""


def test_shapes_are_kept(satellite):
    description = describe_robot(satellite)
    kinds = {shape.name: (shape.kind, shape.roles) for shape in description.shapes}
    assert kinds == {
        "bus_visual_0": ("box", ("visual",)),
        "bus_collision_0": ("sphere", ("collision",)),
        "shoulder_visual_0": ("mesh", ("visual",)),
        "boom_collision_0": ("cylinder", ("collision",)),
    }
    box, _, mesh, cylinder = description.shapes
    np.testing.assert_allclose(box.size, [0.4, 0.35, 0.3])
    np.testing.assert_array_equal(box.position, [0, 0, 0.1])
    assert box.colour == (0.4, 0.5, 0.6, 1.0)
    np.testing.assert_allclose(cylinder.size, [0.05, 0.4])
    # Whatever order they come in, the vertices are the file's, stretched, and span the same triangles.
    found = np.array(sorted(map(tuple, np.round(mesh.vertices, 6))))
    np.testing.assert_allclose(found, sorted((x, y, 2 * z) for x, y, z in CUBE), atol=1e-6)
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas.sum() / 2 == pytest.approx(2 * (0.2 * 0.5 + 0.2 * 0.4 + 0.5 * 0.4), rel=1e-5)


def test_a_file_without_its_meshes_loads_all_the_same(satellite, tmp_path_factory):
    alone = tmp_path_factory.mktemp("elsewhere") / "alone.urdf"
    alone.write_text(URDF, encoding="utf-8")
    ours, whole = load_robot(alone), load_robot(satellite)
    assert len(ours.geometry.shapes) == len(whole.geometry.shapes) - 1
    chex.assert_trees_all_equal(jax.tree.leaves(ours), jax.tree.leaves(whole))


def test_a_colour_a_scale_and_a_broken_mesh(tmp_path):
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    visual = '<visual><geometry><mesh filename="bad.stl"/></geometry></visual>'
    base = link("base").replace("</link>", visual + "</link>")
    path = write(tmp_path, base, link("arm"), joint("j", "base", "arm", "continuous"))
    assert load_robot(path).geometry.shapes == ()
    assert "link 'base': visual shape left out: bad.stl: " in describe_robot(path).notes


# Bases


def test_a_massless_root_leads_to_its_massive_child(tmp_path):
    """The frame above the base, its camera and a second arm hang from the base that is found."""
    parts = (
        link("base_link", False), link("footprint", False), link("inertia_link"), link("arm"), link("eye", False),
        joint("down", "base_link", "footprint", "fixed", xyz="0 0 1"),
        joint("body", "footprint", "inertia_link", "fixed", xyz="1 0 0", rpy="0 0 1.5707963267948966"),
        joint("swing", "base_link", "arm", "continuous", xyz="0 2 0"),
        joint("lens", "base_link", "eye", "fixed", xyz="0 0 5"),
    )  # fmt: skip
    robot = load_robot(write(tmp_path, *parts))
    assert robot.body_names == ("inertia_link", "arm")
    assert robot.end_effector_names == ("eye",)
    # base_link (0, 2, 0) is (-1, 2, -1) from the inertia link, seen in axes turned by 90 degrees.
    np.testing.assert_allclose(robot.joint_position[0], [2, 1, -1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        robot.joint_rotation[0], [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(robot.end_effector_position[0], [0, 1, 4], rtol=0, atol=1e-15)


def test_several_massive_children_are_lumped_in_the_roots_frame(tmp_path):
    parts = (
        link("base_link", False), link("left"), link("right"), link("arm"),
        joint("a", "base_link", "left", "fixed", xyz="0 1 0"), joint("b", "base_link", "right", "fixed", xyz="0 -3 0"),
        joint("swing", "base_link", "arm", "continuous"),
    )  # fmt: skip
    robot = load_robot(write(tmp_path, *parts))
    assert robot.body_names == ("base_link", "arm")
    assert robot.mass[0] == 4
    np.testing.assert_allclose(robot.root_position, [0, 1, 0], rtol=0, atol=1e-15)
    # Two bodies of 2 kg, 2 m from their common centre: 16 kg m^2 beyond their own.
    np.testing.assert_allclose(np.diagonal(robot.inertia[0]), [18, 2, 18], rtol=1e-15)


def test_a_floating_joint_below_a_massless_root_is_the_free_base(tmp_path):
    parts = (
        link("world", False), link("base"), link("arm"), joint("free", "world", "base", "floating", xyz="1 2 3"),
        joint("j", "base", "arm", "continuous"),
    )  # fmt: skip
    robot = load_robot(write(tmp_path, *parts))
    assert robot.body_names == ("base", "arm")
    assert robot.end_effector_names == ("arm",)


def test_leaf_links_are_end_effectors_where_none_is_massless(tmp_path):
    parts = (
        link("b2"), link("base"), link("b1"), joint("one", "base", "b1", "continuous"),
        joint("two", "base", "b2", "continuous"),
    )  # fmt: skip
    robot = load_robot(write(tmp_path, *parts))
    assert robot.end_effector_names == ("b2", "b1")
    assert robot.joint_names == ("one", "two")


def test_an_xml_file_may_be_a_urdf(tmp_path):
    path = write(tmp_path, link("base"), link("arm"), joint("j", "base", "arm", "continuous"), name="arm.xml")
    assert load_robot(path).joint_names == ("j",)


def test_absent_limits(tmp_path):
    """An end that is absent is zero, as the format says; no end at all is no limit."""
    limit = '<limit effort="1" velocity="2" upper="1.5"/>'
    none = '<limit effort="1" velocity="2"/>'
    endless = '<limit lower="-1e308" upper="3" effort="1e308" velocity="inf"/>'
    parts = (
        link("base"), link("a"), link("b"), link("c"), joint("ja", "base", "a", inside=limit),
        joint("jb", "base", "b", inside=none), joint("jc", "base", "c", inside=endless),
    )  # fmt: skip
    limits = load_robot(write(tmp_path, *parts)).limits
    np.testing.assert_array_equal(limits.position_lower, [0, -np.inf, -np.inf])
    np.testing.assert_array_equal(limits.position_upper, [1.5, np.inf, 3])
    np.testing.assert_array_equal(limits.torque, [1, 1, np.inf])
    np.testing.assert_array_equal(limits.velocity, [2, 2, np.inf])


def test_mesh_names(tmp_path):
    """A file name that no folder can hold is a missing mesh, not a defect."""
    names = [
        "package://bad\\\\x.stl",
        "package://x",
        "package://",
        "file:///nowhere/a.stl",
        "a" * 5000,
        "../" * 50 + "a.stl",
        "a.dae",
    ]
    visuals = "".join(f'<visual><geometry><mesh filename="{name}"/></geometry></visual>' for name in names)
    (tmp_path / "a.dae").write_text("<COLLADA/>")
    base = link("base").replace("</link>", visuals + "</link>")
    path = write(tmp_path, base, link("arm"), joint("j", "base", "arm", "continuous"))
    assert load_robot(path).geometry.shapes == ()
    assert "a.dae: meshes of type '.dae' are not read (STL and OBJ are)" in describe_robot(path).notes


def test_a_urdf_may_be_an_arm_of_a_robot_file(satellite):
    twin = satellite.with_name("twin.yaml")
    twin.write_text(
        "name: twin\n"
        "base: {name: base, mass: 300.0, inertia: {xx: 80, yy: 80, zz: 80}}\n"
        "arms:\n"
        "  - {robot: satellite.urdf, position: [0, 0.5, 0], prefix: left_, base: drop}\n"
        "  - {robot: satellite.urdf, position: [0, -0.5, 0], prefix: right_, base: drop}\n",
        encoding="utf-8",
    )
    robot, arm = load_robot(twin), load_robot(satellite)
    assert robot.joint_names == ("left_j1", "left_j2", "left_j3", "right_j1", "right_j2", "right_j3")
    np.testing.assert_array_equal(robot.mass, [300, *arm.mass[1:], *arm.mass[1:]])


def test_mesh_names_with_backslashes(satellite):
    text = URDF.replace(
        "satellite_description/meshes/shoulder.stl", r"satellite_description\meshes\shoulder.stl"
    )
    satellite.write_text(text, encoding="utf-8")
    assert [shape.name for shape in load_robot(satellite).geometry.on_body("shoulder")] == [
        "shoulder_visual_0"
    ]


def test_files_of_another_type_are_refused(tmp_path):
    for name in ("arm.sdf", "arm.urdf.xacro", "arm"):
        (tmp_path / name).write_text("<sdf/>")
        with pytest.raises(
            InputError, match=r"are not read as robots \(allowed: \.yaml, \.yml, \.urdf, \.xml or"
        ):
            load_robot(tmp_path / name)
    (tmp_path / "arm.xml").write_text("\n<sdf/>")
    with pytest.raises(
        InputError, match=r"arm\.xml:2: the first element is <sdf>; <robot> \(URDF\) or <mujoco>"
    ):
        load_robot(tmp_path / "arm.xml")
