"""A robot as URDF text."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from jffsr.robots.formats.export_xml import comment, decimal, decimals, safe_name, unique, xml_text
from jffsr.robots.formats.rpy import matrix_to_rpy
from jffsr.robots.geometry import BOX, CAPSULE, CYLINDER, MESH, SPHERE, Shape
from jffsr.robots.robot import REVOLUTE, Robot

NO_LIMIT = 1e308
"""Stands for a limit that a joint has not: readers of URDF ask for a number and do not know `inf`."""


def to_urdf(robot: Robot) -> str:
    """The robot as URDF text, numbers with 17 digits: `jffsr.load_robot` reads the same robot back.

    The root link's frame is that of the file the robot came from; each other link's sits at its joint. End
    effectors become massless links on fixed joints, so that a robot without any comes back with its leaf
    links. A capsule becomes a cylinder and two spheres; an ellipsoid or a mesh is left out with a comment
    in the text: `jffsr.save_robot` writes meshes beside the file. A body that bears an end effector's name
    gets `_link` appended to its own. An absent limit is written as 1e308, which `load_robot` reads as none.
    """
    return urdf_text(robot, {})


def urdf_text(robot: Robot, mesh_files: Mapping[str, str]) -> str:
    """`to_urdf` with the file names of meshes, by shape."""
    top = robot.topology
    tools = [safe_name(name) for name in top.end_effector_names]
    bodies = body_names(robot, tools)
    root = ET.Element("robot", name=safe_name(robot.name))
    links = []
    for body, name in enumerate(bodies):
        link = ET.SubElement(root, "link", name=name)
        _inertial(link, robot, body)
        for shape in robot.geometry.on_body(top.body_names[body]):
            position = shape.position - (np.asarray(robot.root_position) if body == 0 else 0)
            _shape(link, shape, position, mesh_files)
        links.append(link)
    taken: set[str] = set()
    for joint, parent in enumerate(top.parents):
        _joint(
            root,
            robot,
            joint,
            bodies[parent],
            bodies[joint + 1],
            unique(safe_name(top.joint_names[joint]), taken),
        )
    for number, name in enumerate(tools):
        body = top.end_effector_bodies[number]
        if name == bodies[body]:
            continue
        ET.SubElement(root, "link", name=name)
        fixed = ET.SubElement(root, "joint", name=unique(f"{name}_fixed", taken), type="fixed")
        _ends(fixed, bodies[body], name)
        position = np.asarray(robot.end_effector_position[number])
        _origin(fixed, _from_root(robot, body, position), robot.end_effector_rotation[number])
    return xml_text(root)


def body_names(robot: Robot, tools: list[str]) -> list[str]:
    """A name for each body's link: its own, but for one that an end effector bears.

    Where the end effectors are just the leaf links themselves, they need no links of their own.
    """
    top = robot.topology
    own = [safe_name(name) for name in top.body_names]
    leaves = [body for body in range(1, len(own)) if body not in top.parents]
    at_link = all(
        name == own[body] and not np.any(robot.end_effector_position[k]) and np.array_equal(turn, np.eye(3))
        for k, (name, body, turn) in enumerate(
            zip(tools, top.end_effector_bodies, robot.end_effector_rotation, strict=True)
        )
    )
    if at_link and list(top.end_effector_bodies) == leaves:
        return own
    taken = set(tools)
    return [unique(name if name not in tools else f"{name}_link", taken) for name in own]


def _from_root(robot: Robot, body: int, position: np.ndarray) -> np.ndarray:
    return position - np.asarray(robot.root_position) if body == 0 else position


def _inertial(link: ET.Element, robot: Robot, body: int) -> None:
    inertial = ET.SubElement(link, "inertial")
    com = -np.asarray(robot.root_position) if body == 0 else robot.link_com[body - 1]
    _origin(inertial, com, np.eye(3))
    ET.SubElement(inertial, "mass", value=decimal(robot.mass[body]))
    tensor = np.asarray(robot.inertia[body], dtype=float)
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(inertial, "inertia", {key: decimal(tensor[place]) for key, place in places.items()})


def _joint(root: ET.Element, robot: Robot, joint: int, parent: str, child: str, name: str) -> None:
    limits = robot.limits
    low, high = float(limits.position_lower[joint]), float(limits.position_upper[joint])
    free = np.isinf(low) and np.isinf(high)
    turns = robot.topology.joint_types[joint] == REVOLUTE
    kind = ("continuous" if free else "revolute") if turns else "prismatic"
    element = ET.SubElement(root, "joint", name=name, type=kind)
    _ends(element, parent, child)
    position = np.asarray(robot.joint_position[joint])
    _origin(element, _from_root(robot, robot.topology.parents[joint], position), robot.joint_rotation[joint])
    ET.SubElement(element, "axis", xyz=decimals(robot.joint_axis[joint]))
    values = {} if free and turns else {"lower": low, "upper": high}
    values |= {"effort": float(limits.torque[joint]), "velocity": float(limits.velocity[joint])}
    if np.isfinite(limits.acceleration[joint]):
        values["acceleration"] = float(limits.acceleration[joint])
    ET.SubElement(
        element, "limit", {key: decimal(np.clip(x, -NO_LIMIT, NO_LIMIT)) for key, x in values.items()}
    )


def _ends(joint: ET.Element, parent: str, child: str) -> None:
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)


def _origin(element: ET.Element, position, rotation) -> None:
    ET.SubElement(element, "origin", xyz=decimals(position), rpy=decimals(matrix_to_rpy(rotation)))


def _shape(link: ET.Element, shape: Shape, position: np.ndarray, mesh_files: Mapping[str, str]) -> None:
    solids = list(_solids(shape, position, mesh_files))
    if not solids:
        link.append(comment(f"left out: {shape.kind} {shape.name}"))
    for role in shape.roles:
        for tag, attributes, place in solids:
            element = ET.SubElement(link, role)
            _origin(element, place, shape.rotation)
            ET.SubElement(ET.SubElement(element, "geometry"), tag, attributes)
            if role == "visual" and shape.colour is not None:
                material = ET.SubElement(element, "material", name=f"{safe_name(shape.name)}_colour")
                ET.SubElement(material, "color", rgba=decimals(shape.colour))


def _solids(shape: Shape, position: np.ndarray, mesh_files: Mapping[str, str]):
    """Tag, attributes and position of what URDF has for a shape."""
    size = [float(x) for x in shape.size]
    if shape.kind == BOX:
        yield "box", {"size": decimals([2 * x for x in size])}, position
    elif shape.kind == SPHERE:
        yield "sphere", {"radius": decimal(size[0])}, position
    elif shape.kind in (CYLINDER, CAPSULE):
        yield "cylinder", {"radius": decimal(size[0]), "length": decimal(2 * size[1])}, position
        for side in (-1, 1) if shape.kind == CAPSULE else ():
            yield "sphere", {"radius": decimal(size[0])}, position + side * size[1] * shape.rotation[:, 2]
    elif shape.kind == MESH and shape.name in mesh_files:
        yield "mesh", {"filename": mesh_files[shape.name]}, position
