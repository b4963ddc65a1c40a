"""Robot files with arms and payloads: what they give, and each refusal with file, line, key and advice."""

from __future__ import annotations

import itertools
import re
import shutil

import chex
import jax
import numpy as np
import pytest
from composition_parts import TWO_ARMS
from mujoco import mju_mat2Quat

import jffsr
from jffsr.robots import trail
from jffsr.robots.yaml_schema import rpy_deg_to_matrix

STATION = """\
name: station
base:
  {name: hub, mass: 900, com: [0.1, 0, -0.2], inertia: {xx: 500, yy: 600, zz: 700, xy: 20}}
links:
  - {name: mast, mass: 12, com: [0, 0, 1], inertia: {xx: 4, yy: 4, zz: 0.1}}
joints:
  - {name: foot, type: fixed, parent: hub, child: mast, position: [0, 0, 1], rpy_deg: [0, 20, 0]}
end_effectors:
  - {name: port, link: mast, position: [0, 0, 2], rpy_deg: [0, 180, 0]}
arms:
  - {robot: parts/two.yaml, position: [0.1, 0.2, 0.3], rpy_deg: [10, 20, 90], prefix: a_}
  - {robot: wu_6dof, link: port, base: drop, prefix: b_}
  - robot: hu_planar2
    link: mast
    position: [0.5, 0, 1]
  - {robot: ye_planar3, link: a_left, prefix: c_, base: drop}
payloads:
  - {name: crate, end_effector: b_tool, mass: 40, com: [0.3, 0, 0], inertia: {xx: 3, yy: 4, zz: 5},
     position: [0.1, 0, 0], rpy_deg: [0, 0, 45], shapes: [{type: sphere, size: [0.4]}]}
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with the station and its parts, one of them in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "station.yaml").write_text(STATION)
    (tmp_path / "parts").mkdir()
    shutil.copy(TWO_ARMS, tmp_path / "parts" / "two.yaml")
    return tmp_path


def quaternion(*rpy_deg):
    result = np.zeros(4)
    mju_mat2Quat(result, rpy_deg_to_matrix(rpy_deg).ravel())
    return result


def test_a_file_gives_what_the_functions_give(folder):
    """Arms on the base, on an end effector, on a lumped link, on another arm's tool; a payload on a tool."""
    found = jffsr.load_robot("station.yaml")

    bare = re.sub(r"(?s)arms:.*", "", STATION)
    (folder / "bare.yaml").write_text(bare)
    with pytest.raises(jffsr.InputError, match=r"^bare\.yaml: the robot has no revolute or prismatic joint$"):
        jffsr.load_robot("bare.yaml")
    # The hub with its mast as one rigid body, lumped here by hand about the hub's frame.
    turn = rpy_deg_to_matrix([0, 20, 0])
    mast_com = np.array([0, 0, 1]) + turn @ [0, 0, 1]
    hub_com, hub = np.array([0.1, 0, -0.2]), np.array([[500.0, 20, 0], [20, 600, 0], [0, 0, 700]])
    com = (900 * hub_com + 12 * mast_com) / 912
    inertia = hub + turn @ np.diag([4, 4, 0.1]) @ turn.T
    for mass, at in ((900, hub_com), (12, mast_com)):
        d = np.cross(np.eye(3), at - com)
        inertia = inertia - mass * d @ d
    bus = jffsr.RigidBody.create(912, inertia, com=com, name="hub")
    port = np.array([0, 0, 1]) + turn @ [0, 0, 2]

    robot = jffsr.attach(
        bus,
        jffsr.load_robot(TWO_ARMS),
        position=[0.1, 0.2, 0.3],
        quaternion=quaternion(10, 20, 90),
        prefix="a_",
    )
    robot = jffsr.attach(
        robot,
        jffsr.load_robot("wu_6dof"),
        position=port,
        quaternion=quaternion(0, 200, 0),
        arm_base="drop",
        prefix="b_",
    )
    place = np.array([0, 0, 1]) + turn @ [0.5, 0, 1]
    robot = jffsr.attach(
        robot, jffsr.load_robot("hu_planar2"), position=place, quaternion=quaternion(0, 20, 0)
    )
    robot = jffsr.attach(robot, jffsr.load_robot("ye_planar3"), link="a_left", prefix="c_", arm_base="drop")
    crate = jffsr.RigidBody.create(40, [3, 4, 5], com=[0.3, 0, 0], name="crate")
    robot = jffsr.weld(
        robot, crate, end_effector="b_tool", position=[0.1, 0, 0], quaternion=quaternion(0, 0, 45)
    )

    assert found.joint_names == robot.joint_names
    assert found.body_names == robot.body_names
    assert found.topology.parents == robot.topology.parents
    # The hub's own end effector comes first; as a rigid body, it has none.
    assert found.end_effector_names == ("port", *robot.end_effector_names)
    np.testing.assert_allclose(found.end_effector_position[0] - found.root_position, port, atol=1e-12)
    for name in ("mass", "inertia", "link_com", "joint_position", "joint_rotation", "root_position"):
        chex.assert_trees_all_close(getattr(found, name), getattr(robot, name), rtol=1e-13, atol=1e-11)
    (ball,) = (shape for shape in found.geometry.on_body("b_link6") if shape.name == "crate_sphere_0")
    tool = found.end_effector_position[found.end_effector_names.index("b_tool")]
    np.testing.assert_allclose(np.linalg.norm(ball.position - tool), 0.1, rtol=1e-12)


def test_right_angles_of_a_mount_stay_exact():
    """A file's mounts keep axes parallel to the last bit, which a quaternion would not."""
    robot = jffsr.load_robot("dual_arm_servicer")
    for rotation in robot.joint_rotation:
        np.testing.assert_array_equal(np.abs(rotation).sum(axis=0), [1, 1, 1])


def replaced(old, new):
    assert STATION.count(old) == 1
    return {"station.yaml": STATION.replace(old, new)}


ARM = "name: {0}\nbase: {{name: hub, mass: 9, inertia: {{xx: 1, yy: 1, zz: 1}}}}\narms:\n  - {{robot: {1}}}\n"
REFUSED = {
    "unknown robot": (
        replaced("robot: wu_6dof", "robot: wu_6dfo"),
        r"station.yaml:12: arms.1.robot: robot 'wu_6dfo' is not in the catalogue; did you mean 'wu_6dof'? (known:",
    ),
    "missing file": (
        replaced("parts/two.yaml", "parts/tow.yaml"),
        "station.yaml:11: arms.0.robot: parts/tow.yaml: there is no such file",
    ),
    "unknown link": (
        replaced("link: mast\n", "link: mats\n"),
        "station.yaml:14: arms.2.link: found 'mats', which 'station' does not have; did you mean 'mast'? (it has "
        "port, ",
    ),
    "a link that comes later": (
        replaced("link: port", "link: c_tip"),
        "station.yaml:12: arms.1.link: found 'c_tip', which 'station' does not have",
    ),
    "base neither kept nor dropped": (
        replaced("link: port, base: drop", "link: port, base: dorp"),
        "station.yaml:12: arms.1.base: found 'dorp', 'keep' or 'drop' is expected; did you mean 'drop'?",
    ),
    "a misspelt key": (
        replaced("link: port", "linc: port"),
        "station.yaml:12: arms.1.linc: unknown key; did you mean 'link'?",
    ),
    "clash of joints": (
        replaced(
            "hu_planar2\n    link: mast\n    position: [0.5, 0, 1]\n",
            "parts/two.yaml\n    link: mast\n    position: [0.5, 0, 1]\n    prefix: a_\n",
        ),
        "station.yaml:16: arms.2.prefix: both have a joint named 'a_left_shoulder'; give the arm a prefix that makes "
        "its names differ, such as 'two_arms_'",
    ),
    "a place that is none": (
        replaced("position: [0.5, 0, 1]", "position: [0.5, .nan, 1]"),
        "station.yaml:15: arms.2.position: [0.5, nan, 1.0] is not finite",
    ),
    "angles that are none": (
        replaced("rpy_deg: [10, 20, 90]", "rpy_deg: [10, .inf, 90]"),
        "station.yaml:11: arms.0.rpy_deg: found what is no rotation; finite angles are expected",
    ),
    "a payload on nothing": (
        replaced("end_effector: b_tool", "end_effector: b_tol"),
        "station.yaml:18: payloads.0.end_effector: found 'b_tol', which 'station' does not have; did you mean "
        "'b_tool'? (it has port, a_left, a_right, b_tool, tip, c_tip)",
    ),
    "a payload that no body can be": (
        replaced("zz: 5},\n", "zz: 50},\n"),
        "station.yaml:18: payloads.0: link 'crate': principal moments of inertia (3, 4, 50) kg m^2 break the "
        "triangle inequality",
    ),
    "a shape that is none": (
        replaced("size: [0.4]", "size: [-0.4]"),
        "station.yaml:19: payloads.0.shapes: shape 'crate_sphere_0': size [-0.4]; a sphere needs 1 positive numbers",
    ),
    "itself": (
        {"station.yaml": ARM.format("station", "./station.yaml")},
        "station.yaml:4: arms.0.robot: the robots are made of each other in a circle (station.yaml -> "
        "station.yaml)",
    ),
    "itself through another": (
        {
            "station.yaml": ARM.format("station", "parts/b.yaml"),
            "parts/b.yaml": ARM.format("b", "../station.yaml"),
        },
        "station.yaml:4: arms.0.robot: parts/b.yaml:4: arms.0.robot: the robots are made of each other in a circle "
        "(station.yaml -> parts/b.yaml -> parts/../station.yaml)",
    ),
    "a place out of all range": (
        replaced("position: [0.1, 0.2, 0.3]", "position: [1e200, 0.2, 0.3]"),
        "station.yaml: link 'hub': the inertia of what is fixed to it is too large a number; distances in m",
    ),
    "no joint in an arm": (
        {
            "station.yaml": ARM.format("station", "b.yaml"),
            "b.yaml": ARM.format("b", "wu_6dof").split("arms")[0],
        },
        "b.yaml: the robot has no revolute or prismatic joint",
    ),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_refused_with_file_line_key_and_advice(folder, fault):
    files, sentence = REFUSED[fault]
    for name, text in files.items():
        (folder / name).write_text(text)
    with pytest.raises(jffsr.InputError) as told:
        jffsr.load_robot("station.yaml")
    assert str(told.value).startswith(sentence)
    assert "\n" not in str(told.value)


def test_depth_and_number_are_bounded(folder):
    """No small set of files grows into a large robot."""
    for level in range(trail.MAX_LEVELS + 1):
        (folder / f"r{level}.yaml").write_text(ARM.format(f"r{level}", f"r{level + 1}.yaml"))
    with pytest.raises(jffsr.InputError, match=r"^r0\.yaml:4: .*more than 10 levels deep$"):
        jffsr.load_robot("r0.yaml")
    for level in range(4):
        robot = f"r{level + 1}.yaml" if level < 3 else "hu_planar2"
        arms = "".join(f"  - {{robot: {robot}, prefix: p{i}_}}\n" for i in range(5))
        text = ARM.format(f"r{level}", "x").split("  - ")[0] + arms
        (folder / f"r{level}.yaml").write_text(text)
    with pytest.raises(
        jffsr.InputError, match=r"^r0\.yaml:4: .*: the robot is made of more than 100 robots$"
    ):
        jffsr.load_robot("r0.yaml")
    robot = jffsr.load_robot("r2.yaml")
    assert robot.num_joints == 50
    assert {leaf.dtype for leaf in jax.tree.leaves(robot)} == {np.dtype(float)}


def test_the_same_robot_twice_is_no_circle(folder):
    (folder / "station.yaml").write_text(
        ARM.format("station", "parts/two.yaml") + "  - {robot: parts/two.yaml, prefix: b_}\n"
    )
    assert jffsr.load_robot("station.yaml").num_joints == 10


def test_the_dual_arm_servicer_stands_clear_of_its_bus():
    """At zero angles the shoulders are on the faces, and all else of both arms is outside the box."""
    robot = jffsr.load_robot("dual_arm_servicer")
    (box,) = robot.geometry.on_body("bus")
    state = jffsr.State(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(14))
    kin = jffsr.kinematics(robot, state)
    for side, first in ((1, 0), (-1, 7)):
        tool, _ = jffsr.end_effector_pose(robot, kin, robot.end_effector_names[first // 7])
        nodes = np.array([*kin.anchor[first : first + 7], tool])
        np.testing.assert_allclose(nodes[0], [0.6, side * box.size[1], 0.0], rtol=0, atol=1e-12)
        ends = np.array([0.6 + 1.3, side * (0.8 + 1.3441809549), side * 0.252])
        np.testing.assert_allclose(nodes[-1], ends, rtol=0, atol=1e-12)
        along = np.linspace(0, 1, 50)[:, None]
        points = np.concatenate([(1 - along) * a + along * b for a, b in itertools.pairwise(nodes)])
        beyond = np.max(np.abs(points) - box.size, axis=1)
        assert np.all(beyond > -1e-12)
        assert np.all(beyond[50:] > 0.3)
    # A uniform box of the bus's size and mass.
    sides = 2 * box.size
    moments = 1500 / 12 * (np.sum(sides**2) - sides**2)
    np.testing.assert_allclose(robot.inertia[0], np.diag(moments), rtol=1e-12)
