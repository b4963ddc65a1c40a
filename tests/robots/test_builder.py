"""What the builder refuses, with its sentence, and what it makes of fixed joints and disordered ones."""

from __future__ import annotations

import copy
import re

import chex
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jffsr.dynamics.kinematics import end_effector_pose, kinematics, system_com
from jffsr.errors import InputError
from jffsr.robots.builder import build_robot
from jffsr.robots.description import JointDescription, RobotDescription
from jffsr.robots.state import State
from jffsr.robots.yaml_schema import RobotModel, rpy_deg_to_matrix

INERTIA = {"xx": 1.0, "yy": 1.2, "zz": 1.4}


def _link(name, **changes):
    return {"name": name, "mass": 2.0, "com": [0.1, 0.0, 0.0], "inertia": dict(INERTIA)} | changes


def _joint(name, parent, child, **changes):
    return {
        "name": name, "type": "revolute", "parent": parent, "child": child,
        "position": [0.5, 0.0, 0.0], "axis": [0.0, 0.0, 1.0],
    } | changes  # fmt: skip


def _arm():
    """A plain record that the builder accepts: a base with two links and a tool."""
    return {
        "name": "arm",
        "base": _link("base", mass=10.0),
        "links": [_link("upper"), _link("lower")],
        "joints": [_joint("shoulder", "base", "upper"), _joint("elbow", "upper", "lower")],
        "end_effectors": [{"name": "tool", "link": "lower", "position": [1.0, 0.0, 0.0]}],
    }


def _build(record):
    return build_robot(RobotModel.model_validate(record).describe("arm.yaml"))


def _set(*path_and_value):
    *path, key, value = path_and_value

    def change(record):
        for step in path:
            record = record[step]
        record[key] = value

    return change


def _append(key, item):
    return lambda record: record[key].append(item)


UPPER = ("links", 0)
ELBOW = ("joints", 1)
REFUSED = {
    "mass zero": (_set(*UPPER, "mass", 0.0), "link 'upper': mass is 0 kg; it must be positive"),
    "mass negative": (_set("base", "mass", -3.0), "link 'base': mass is -3 kg; it must be positive"),
    "mass nan": (
        _set(*UPPER, "mass", np.nan),
        "link 'upper': mass is nan; a finite number of kg is expected",
    ),
    "mass infinite": (
        _set(*UPPER, "mass", np.inf),
        "link 'upper': mass is inf; a finite number of kg is expected",
    ),
    "com nan": (
        _set(*UPPER, "com", [0, np.nan, 0]),
        "link 'upper': centre of mass [0.0, nan, 0.0] is not finite",
    ),
    "inertia nan": (_set(*UPPER, "inertia", "xy", np.nan), "link 'upper': inertia [[1.0, nan"),
    "inertia negative": (
        _set(*UPPER, "inertia", "xx", -1.0),
        "link 'upper': principal moments of inertia (-1, 1.2, 1.4) kg m^2; all must be positive",
    ),
    "inertia zero": (
        _set(*UPPER, "inertia", {"xx": 0.0, "yy": 0.0, "zz": 0.0}),
        "link 'upper': principal moments of inertia (0, 0, 0) kg m^2; all must be positive",
    ),
    "inertia indefinite by its products": (
        _set(*UPPER, "inertia", {**INERTIA, "xy": 2.0}),
        "all must be positive",
    ),
    "triangle inequality": (
        _set(*UPPER, "inertia", "zz", 2.5),
        "link 'upper': principal moments of inertia (1, 1.2, 2.5) kg m^2 break the triangle inequality: "
        "1 + 1.2 is less than 2.5, which no rigid body can have",
    ),
    "axis zero": (
        _set(*ELBOW, "axis", [0.0, 0.0, 0.0]),
        "joint 'elbow': axis [0.0, 0.0, 0.0] has length zero",
    ),
    "axis missing": (_set(*ELBOW, "axis", None), "joint 'elbow': axis [0.0, 0.0, 0.0] has length zero"),
    "axis nan": (_set(*ELBOW, "axis", [np.nan, 0, 1]), "joint 'elbow': axis [nan, 0.0, 1.0] is not finite"),
    "joint position infinite": (
        _set(*ELBOW, "position", [np.inf, 0, 0]),
        "joint 'elbow': position [inf, 0.0, 0.0] is not finite",
    ),
    "joint rotation nan": (
        _set(*ELBOW, "rpy_deg", [np.nan, 0, 0]),
        "joint 'elbow': rotation [[nan, nan, nan], ",
    ),
    "limits reversed": (
        _set(*ELBOW, "limits", {"position": [1.0, -1.0]}),
        "joint 'elbow': position limits [1, -1]; the lower must be less than the upper",
    ),
    "limits nan": (
        _set(*ELBOW, "limits", {"position": [np.nan, 1.0]}),
        "joint 'elbow': position limits [nan, 1]",
    ),
    "rate limit zero": (
        _set(*ELBOW, "limits", {"rate": 0.0}),
        "joint 'elbow': velocity limit is 0; it must be positive",
    ),
    "acceleration limit negative": (
        _set(*ELBOW, "limits", {"acceleration": -1.0}),
        "joint 'elbow': acceleration limit is -1; it must be positive",
    ),
    "torque limit nan": (
        _set(*ELBOW, "limits", {"torque": np.nan}),
        "joint 'elbow': torque limit is nan; it must be positive",
    ),
    "two links of one name": (
        _set("links", 1, "name", "upper"),
        "two links are named 'upper'; names must differ",
    ),
    "two joints of one name": (
        _set(*ELBOW, "name", "shoulder"),
        "two joints are named 'shoulder'; names must differ",
    ),
    "two tools of one name": (
        _append("end_effectors", {"name": "tool", "link": "upper"}),
        "two end effectors are named 'tool'; names must differ",
    ),
    "unknown parent": (_set(*ELBOW, "parent", "uper"), "joint 'elbow': parent link 'uper' does not exist"),
    "unknown child": (_set(*ELBOW, "child", "hand"), "joint 'elbow': child link 'hand' does not exist"),
    "tool on an unknown link": (
        _set("end_effectors", 0, "link", "hand"),
        "end effector 'tool': link 'hand' does not exist",
    ),
    "tool nan": (
        _set("end_effectors", 0, "position", [np.nan, 0, 0]),
        "end effector 'tool': its pose is not finite",
    ),
    "two parents": (
        _append("joints", _joint("strut", "base", "lower")),
        "link 'lower' has two parents (joints 'elbow' and 'strut'); closed loops are not supported",
    ),
    "root moved": (
        _append("joints", _joint("back", "lower", "base")),
        "joint 'back' moves the root link 'base'; closed loops are not supported",
    ),
    "loop": (
        _set("joints", 0, "parent", "lower"),
        "link 'upper' hangs in a loop of joints that never reaches the root",
    ),
    "joint onto itself": (
        _set("joints", 0, "parent", "upper"),
        "link 'upper' hangs in a loop of joints that never reaches the root",
    ),
    "orphan": (
        _append("links", _link("debris")),
        "link 'debris' is an orphan: no joint connects it to the root 'base'",
    ),
    "only fixed joints": (
        lambda record: [joint.update(type="fixed") for joint in record["joints"]],
        "the robot has no revolute or prismatic joint",
    ),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_refused_with_its_sentence(fault):
    change, sentence = REFUSED[fault]
    record = copy.deepcopy(_arm())
    change(record)
    with pytest.raises(InputError, match=r"^arm\.yaml: .*" + re.escape(sentence)):
        _build(record)


def test_the_unchanged_record_is_accepted():
    """So each refusal above has the one cause that it names."""
    robot = _build(_arm())
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.body_names == ("base", "upper", "lower")


def _describe(joint_changes):
    """A description that does not come from YAML, whose schema would refuse first."""
    whole = RobotModel.model_validate(_arm()).describe("arm.yaml")
    elbow = whole.joints[1].__dict__ | joint_changes
    return RobotDescription(
        **(whole.__dict__ | {"joints": (whole.joints[0], JointDescription(**elbow))}),
    )


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"type": "ball"},
            "joint 'elbow': type 'ball' is not supported; allowed are revolute, prismatic, fixed",
        ),
        ({"rotation": 2 * np.eye(3)}, "joint 'elbow': rotation is not a rotation matrix"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "joint 'elbow': rotation is not a rotation matrix"),
    ],
)
def test_faults_that_only_a_program_can_make(changes, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        build_robot(_describe(changes))


def test_an_asymmetric_inertia_is_refused():
    whole = RobotModel.model_validate(_arm()).describe("arm.yaml")
    whole.links[1].inertia[0, 1] = 0.1
    with pytest.raises(InputError, match="link 'upper': inertia is not symmetric"):
        build_robot(whole)


def test_the_triangle_inequality_holds_for_a_thin_rod_and_a_flat_disc():
    """The limits of what a rigid body can be are allowed, rounding included."""
    record = _arm()
    record["links"][0]["inertia"] = {"xx": 0.1, "yy": 0.2, "zz": 0.1 + 0.2 + 1e-16}
    record["links"][1]["inertia"] = {"xx": 1e-9, "yy": 1.0, "zz": 1.0}
    _build(record)


def test_axes_are_normalised_and_limits_are_read_in_degrees():
    record = _arm()
    record["joints"][1] |= {"axis": [0.0, 3.0, 4.0], "limits": {"position_deg": [-90, 180], "rate_deg": 10}}
    robot = _build(record)
    np.testing.assert_allclose(robot.joint_axis[1], [0, 0.6, 0.8], rtol=1e-15)
    np.testing.assert_allclose(robot.limits.position_lower, [-np.inf, -np.pi / 2])
    np.testing.assert_allclose(robot.limits.position_upper, [np.inf, np.pi])
    np.testing.assert_allclose(robot.limits.velocity, [np.inf, np.deg2rad(10)])


def test_joints_may_stand_out_of_tree_order():
    """The same robot from a file whose joints are listed from the tool to the base."""
    record = _arm()
    record["links"].append(_link("hand"))
    record["joints"].append(_joint("wrist", "lower", "hand", axis=[0.0, 1.0, 0.0]))
    ordered = _build(record)
    record["joints"].reverse()
    turned = _build(record)
    assert turned.topology == ordered.topology
    assert turned.joint_names == ("shoulder", "elbow", "wrist")
    chex.assert_trees_all_equal(turned, ordered)


def test_a_branch_keeps_the_order_of_the_file():
    record = _arm()
    record["links"].append(_link("second"))
    record["joints"].insert(0, _joint("other", "base", "second"))
    robot = _build(record)
    assert robot.joint_names == ("other", "shoulder", "elbow")
    assert robot.topology.parents == (0, 0, 2)
    np.testing.assert_array_equal(
        robot.topology.support,
        [[False, False, False], [True, False, False], [False, True, False], [False, True, True]],
    )


def _with_fixed(position, rpy_deg, parent):
    record = _arm()
    record["links"].append(_link("box", mass=3.0, com=[0.2, -0.1, 0.3], inertia={**INERTIA, "xy": 0.1}))
    record["joints"].append(
        {
            "name": "weld",
            "type": "fixed",
            "parent": parent,
            "child": "box",
            "position": position,
            "rpy_deg": rpy_deg,
        }
    )
    record["end_effectors"].append({"name": "corner", "link": "box", "position": [0.0, 0.0, 0.5]})
    return record


@pytest.mark.parametrize("parent", ["base", "upper"])
def test_a_fixed_link_is_lumped_by_the_parallel_axis_theorem(parent):
    position, rpy_deg = [0.4, 0.3, -0.2], [30.0, 20.0, 10.0]
    robot = _build(_with_fixed(position, rpy_deg, parent))
    body = robot.body_names.index(parent)
    assert "box" not in robot.body_names

    rotation = rpy_deg_to_matrix(rpy_deg)
    own_mass, own_com = (10.0 if parent == "base" else 2.0), np.array([0.1, 0, 0])
    box_com = position + rotation @ np.array([0.2, -0.1, 0.3])
    box = np.array([[1.0, 0.1, 0], [0.1, 1.2, 0], [0, 0, 1.4]])
    mass = own_mass + 3.0
    com = (own_mass * own_com + 3.0 * box_com) / mass

    def about(m, inertia, r):
        return inertia + m * (r @ r * np.eye(3) - np.outer(r, r))

    # Both bodies about the frame's origin, then back to the common centre of mass.
    at_origin = about(own_mass, np.diag([1.0, 1.2, 1.4]), own_com) + about(
        3.0, rotation @ box @ rotation.T, box_com
    )
    expected = at_origin - mass * (com @ com * np.eye(3) - np.outer(com, com))
    np.testing.assert_allclose(robot.mass[body], mass, rtol=1e-15)
    np.testing.assert_allclose(robot.inertia[body], expected, rtol=0, atol=1e-13)
    if parent == "base":
        np.testing.assert_allclose(robot.root_position, -com, rtol=0, atol=1e-15)
        np.testing.assert_allclose(robot.joint_position[0], np.array([0.5, 0, 0]) - com, rtol=0, atol=1e-15)
    else:
        np.testing.assert_allclose(robot.link_com[body - 1], com, rtol=0, atol=1e-15)


@pytest.mark.parametrize("parent", ["base", "upper"])
def test_lumping_moves_nothing(parent):
    """A joint held at zero and a fixed joint are the same thing: tool poses and centre of mass agree."""
    record = _with_fixed([0.4, 0.3, -0.2], [30.0, 20.0, 10.0], parent)
    lumped = _build(record)
    record["joints"][-1] |= {"type": "revolute", "axis": [0.0, 1.0, 0.0]}
    jointed = _build(record)

    def world(robot, q):
        """Poses from the root link's frame, which both robots share."""
        at = State(-robot.root_position, np.array([1.0, 0, 0, 0]), jnp.stack(q))
        kin = kinematics(robot, at)
        return [system_com(robot, kin)] + [end_effector_pose(robot, kin, name) for name in ("tool", "corner")]

    world = jax.jit(world)
    chex.assert_trees_all_close(
        world(lumped, [0.3, -0.4]), world(jointed, [0.3, -0.4, 0.0]), rtol=0, atol=1e-14
    )


def test_a_chain_of_fixed_joints_carries_a_moving_one():
    """Frames add up through links that are lumped away."""
    record = _arm()
    record["joints"][0] |= {"type": "fixed", "rpy_deg": [0.0, 0.0, 90.0]}
    record["base"]["com"] = [0.0, 0.0, 0.0]
    robot = _build(record)
    assert robot.joint_names == ("elbow",)
    assert robot.body_names == ("base", "lower")
    com = np.array([0.5, 0.1, 0]) * 2 / 12
    np.testing.assert_allclose(robot.joint_position[0], np.array([0.5, 0.5, 0]) - com, rtol=0, atol=1e-15)
    np.testing.assert_allclose(robot.joint_rotation[0], rpy_deg_to_matrix([0, 0, 90]), rtol=0, atol=0)


def test_roll_pitch_yaw_order():
    """R = Rz(yaw) Ry(pitch) Rx(roll), and right angles are exact."""
    np.testing.assert_array_equal(rpy_deg_to_matrix([90, 0, 90]) @ [0, 1, 0], [0, 0, 1])
    np.testing.assert_array_equal(rpy_deg_to_matrix([90, 0, 90]) @ [0, 0, 1], [1, 0, 0])
    np.testing.assert_array_equal(np.abs(rpy_deg_to_matrix([180, -90, 270])).sum(axis=0), [1, 1, 1])
    rotation = rpy_deg_to_matrix([10, 20, 30])
    np.testing.assert_allclose(np.arcsin(-rotation[2, 0]), np.deg2rad(20), rtol=1e-14)
    np.testing.assert_allclose(np.arctan2(rotation[2, 1], rotation[2, 2]), np.deg2rad(10), rtol=1e-14)
    np.testing.assert_allclose(np.arctan2(rotation[1, 0], rotation[0, 0]), np.deg2rad(30), rtol=1e-14)


def test_a_robot_without_end_effectors_is_a_robot():
    robot = _build(_arm() | {"end_effectors": []})
    chex.assert_shape(robot.end_effector_position, (0, 3))
    with pytest.raises(InputError, match="robot 'arm' has no end effector 'None'; it has \\[\\]"):
        robot.end_effector_index(None)
    assert jax.tree.structure(robot) == jax.tree.structure(robot.replace(mass=2 * robot.mass))


def test_whole_turns_cost_no_digits():
    """A remainder of degrees is exact; radians of as many turns have a ten-thousandth of a turn to spare."""
    turns = 360.0 * 2**36
    found = rpy_deg_to_matrix((30.0 + turns, -75.0 - turns, 90.0 + turns))
    np.testing.assert_array_equal(found, rpy_deg_to_matrix((30.0, -75.0, 90.0)))
    assert np.isnan(rpy_deg_to_matrix((0.0, np.inf, 0.0))).any()
