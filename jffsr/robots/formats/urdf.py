"""URDF: links, joints and limits from the text itself, number by number."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.reading.xml_tree import Node
from jffsr.robots.description import (
    FIXED,
    JointDescription,
    LinkDescription,
    RobotDescription,
)
from jffsr.robots.formats.leaves import leaf_end_effectors
from jffsr.robots.formats.rpy import rpy_to_matrix
from jffsr.robots.formats.urdf_root import FLOATING, settle_root
from jffsr.robots.formats.urdf_shapes import read_shapes
from jffsr.robots.formats.xml_values import (
    MOST_BODIES,
    at_most_one,
    bound,
    foreign,
    name_of,
    number,
    numbers,
    only_attributes,
)
from jffsr.robots.robot import PRISMATIC, REVOLUTE

_TYPES = {
    "revolute": REVOLUTE,
    "continuous": REVOLUTE,
    "prismatic": PRISMATIC,
    "fixed": FIXED,
    "floating": FLOATING,
}
_MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
# What belongs to controllers, simulators and drawings is passed over without a word.
_HARMLESS_IN_ROBOT = {"gazebo", "transmission", "material", "ros2_control", "sensor", "mujoco", "group"}
_HARMLESS_IN_LINK = {
    "gazebo",
    "material",
    "sensor",
    "collision_checking",
    "self_collision_checking",
    "contact",
}
_HARMLESS_IN_JOINT = {"calibration", "safety_controller", "gazebo", "hardwareInterface"}


def describe_urdf(root: Node, shown: str, folder: Path) -> RobotDescription:
    """The description of a <robot> element; `shown` is the file's name, meshes are looked for from `folder`."""
    if any(node.tag.startswith("xacro:") for node in root.walk()):
        raise InputError(
            f"{shown}: this is a xacro file, a program that writes a URDF; run it first (xacro FILE > robot.urdf)"
        )
    left_out = (
        foreign(root, {"link", "joint", "loop_joint"}, _HARMLESS_IN_ROBOT, "robot") - _HARMLESS_IN_ROBOT
    )
    for loop in root.all("loop_joint"):
        raise InputError(f"{loop.place}: loop joint '{loop.get('name')}': closed loops are not supported")
    notes = [f"elements <{tag}> are passed over" for tag in sorted(left_out)]
    links = [_link(node, notes) for node in root.all("link")]
    joints = [_joint(node, notes) for node in root.all("joint")]
    if not 0 < len(links) <= MOST_BODIES or len(joints) > MOST_BODIES:
        said = f"more than {MOST_BODIES} links or joints" if links else "no link"
        raise InputError(f"{shown}: the robot has {said}")
    shapes, missing = read_shapes(root.all("link"), folder)
    links, joints, skipped = settle_root(links, joints, shown)
    here = {link.name for link in links}
    return RobotDescription(
        name=root.get("name").strip()[:200] or Path(shown).stem,
        origin=shown,
        links=tuple(links),
        joints=tuple(joints),
        end_effectors=leaf_end_effectors(links, joints, [n.get("name") for n in root.all("link")], skipped),
        shapes=tuple(shape for shape in shapes if shape.body in here),
        description="a robot from a URDF file",
        notes="; ".join(notes + missing),
    )


def _link(node: Node, notes: list[str]) -> LinkDescription:
    name = name_of(node, "name", node.place)
    place = f"{node.place}: link '{name}'"
    only_attributes(node, ("name", "type"), place)
    left_out = foreign(node, {"inertial", "visual", "collision"}, _HARMLESS_IN_LINK, f"link '{name}'")
    notes += [f"link '{name}': <{tag}> is passed over" for tag in sorted(left_out - _HARMLESS_IN_LINK)]
    inertial = at_most_one(node, "inertial", place)
    if inertial is None:
        return LinkDescription.frame(name)
    place = f"{inertial.place}: link '{name}'"
    foreign_tags = foreign(inertial, {"origin", "mass", "inertia"}, (), f"link '{name}'")
    if foreign_tags:
        raise InputError(
            f"{place}: <inertial> has an element <{foreign_tags.pop()}>; allowed are origin, mass, inertia"
        )
    parts = {tag: at_most_one(inertial, tag, place) for tag in ("mass", "inertia")}
    for tag, part in parts.items():
        if part is None:
            raise InputError(f"{place}: <inertial> has no <{tag}>")
        only_attributes(part, ("value",) if tag == "mass" else _MOMENTS, place)
    mass = number(parts["mass"], "value", place)
    xx, xy, xz, yy, yz, zz = (number(parts["inertia"], key, place) for key in _MOMENTS)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    position, rotation = pose(inertial, place)
    if mass == 0 and not tensor.any():
        return LinkDescription.frame(name)
    return LinkDescription(name, mass, position, rotation @ tensor @ rotation.T)


def pose(node: Node, place: str) -> tuple[np.ndarray, np.ndarray]:
    """Position and rotation matrix of the <origin> in an element, zero and one where there is none."""
    origin = at_most_one(node, "origin", place)
    if origin is None:
        return np.zeros(3), np.eye(3)
    only_attributes(origin, ("xyz", "rpy"), place)
    rpy = numbers(origin, "rpy", 3, place, (0, 0, 0))
    return numbers(origin, "xyz", 3, place, (0, 0, 0)), rpy_to_matrix(tuple(float(angle) for angle in rpy))


def _joint(node: Node, notes: list[str]) -> JointDescription:
    name = name_of(node, "name", node.place)
    place = f"{node.place}: joint '{name}'"
    only_attributes(node, ("name", "type"), place)
    known = {"origin", "parent", "child", "axis", "limit", "mimic", "dynamics"}
    left_out = foreign(node, known, _HARMLESS_IN_JOINT, f"joint '{name}'") - _HARMLESS_IN_JOINT
    notes += [f"joint '{name}': <{tag}> is passed over" for tag in sorted(left_out)]
    kind = name_of(node, "type", place)
    if kind not in _TYPES:
        raise InputError(
            f"{place}: type '{kind}' is not supported{hint(kind, _TYPES)} "
            "(allowed: revolute, continuous, prismatic, fixed; floating below a massless root)"
        )
    if node.all("mimic"):
        raise InputError(
            f"{place}: <mimic> couples it to another joint, which is not supported; remove it to move the joint freely"
        )
    ends = {}
    for role in ("parent", "child"):
        end = at_most_one(node, role, place)
        if end is None:
            raise InputError(f"{place}: it has no <{role}>")
        only_attributes(end, ("link",), place)
        ends[role] = name_of(end, "link", place)
    position, rotation = pose(node, place)
    axis = at_most_one(node, "axis", place)
    if axis is not None:
        only_attributes(axis, ("xyz",), place)
    _note_dynamics(node, name, place, notes)
    moves = kind not in ("fixed", "floating")
    return JointDescription(
        name=name,
        type=_TYPES[kind],
        parent=ends["parent"],
        child=ends["child"],
        position=position,
        rotation=rotation,
        axis=np.array([1.0, 0, 0]) if axis is None or not moves else numbers(axis, "xyz", 3, place),
        **(_limits(node, kind, place, name, notes) if moves else {}),
    )


def _note_dynamics(node: Node, name: str, place: str, notes: list[str]) -> None:
    dynamics = at_most_one(node, "dynamics", place)
    if dynamics is None:
        return
    for what in ("damping", "friction"):
        if what in dynamics.attributes and number(dynamics, what, place):
            notes.append(f"joint '{name}': {what} {dynamics.get(what)} is left out")


def _limits(node: Node, kind: str, place: str, name: str, notes: list[str]) -> dict:
    limit = at_most_one(node, "limit", place)
    if limit is None:
        if kind != "continuous":
            notes.append(f"joint '{name}': no limits are stated")
        return {}
    allowed = ("lower", "upper", "effort", "velocity", "acceleration", "deceleration", "jerk")
    only_attributes(limit, allowed, place)
    found = {key: bound(limit, key, place) for key in allowed if key in limit.attributes}
    read = {}
    if kind != "continuous" and ("lower" in found or "upper" in found):
        # By the format's rule an end that is not stated is zero.
        read["position_limit"] = (found.get("lower", 0.0), found.get("upper", 0.0))
    elif kind != "continuous":
        notes.append(f"joint '{name}': no position limits are stated")
    for key, field in (
        ("velocity", "velocity_limit"), ("effort", "torque_limit"), ("acceleration", "acceleration_limit")
    ):  # fmt: skip
        if found.get(key) == 0:
            # What exporters write where they know none.
            notes.append(f"joint '{name}': {key} limit 0 is read as none")
        elif key in found:
            read[field] = found[key]
    if math.isfinite(found.get("deceleration", math.inf)):
        notes.append(f"joint '{name}': deceleration limit is left out")
    return read
