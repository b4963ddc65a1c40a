"""A robot as MJCF text."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from jffsr.robots.formats.export_xml import decimal, decimals, safe_name, unique, xml_text
from jffsr.robots.formats.mjcf_shapes import COLLISION_GROUP
from jffsr.robots.formats.rpy import matrix_to_quaternion
from jffsr.robots.geometry import COLLISION, MESH, VISUAL, Shape
from jffsr.robots.principal import principal_axes
from jffsr.robots.robot import REVOLUTE, Robot

_WIDEST = 1e10
"""MuJoCo's largest number; it stands for the open end of a range."""
_VISUAL_GROUP = 2


def to_mjcf(robot: Robot) -> str:
    """The robot as MJCF text, numbers with 17 digits: `jffsr.load_robot` reads the same robot back.

    Without gravity, on a free base whose frame is that of the file's root link, with a motor at every
    joint, end effectors as sites, and shapes as geoms of no mass; meshes stand in the text itself. Limits
    of position and torque are the joints' own; those of velocity and acceleration, for which MJCF has no
    attribute, stand as numbers named `velocity_limit:JOINT` under <custom>, as does the order of joints and
    end effectors where it is not that of the bodies. Inertias are given by principal moments and axes,
    which MuJoCo takes as they are.
    """
    top = robot.topology
    model = ET.Element("mujoco", model=safe_name(robot.name))
    ET.SubElement(model, "compiler", angle="radian", inertiafromgeom="false", fusestatic="false")
    ET.SubElement(model, "option", gravity="0 0 0", integrator="RK4")
    meshes = [shape for shape in robot.geometry.shapes if shape.kind == MESH]
    asset = ET.SubElement(model, "asset") if meshes else None
    taken: set[str] = set()
    names = {id(shape): unique(safe_name(shape.name), taken) for shape in robot.geometry.shapes}
    for shape in meshes:
        ET.SubElement(
            asset, "mesh", name=names[id(shape)], inertia="shell",
            vertex=decimals(shape.vertices), face=" ".join(str(int(i)) for i in np.ravel(shape.faces)),
        )  # fmt: skip
    world = ET.SubElement(model, "worldbody")
    taken = {"world"}
    elements: list[ET.Element] = []
    for body, name in enumerate(top.body_names):
        element = ET.SubElement(
            elements[top.parents[body - 1]] if body else world, "body", name=unique(safe_name(name), taken)
        )
        elements.append(element)
        if body == 0:
            ET.SubElement(element, "freejoint", name=unique("base_free", set(top.joint_names)))
        else:
            _joint(element, robot, body - 1)
        _inertial(element, robot, body)
        for shape in robot.geometry.on_body(name):
            position = shape.position - (np.asarray(robot.root_position) if body == 0 else 0)
            _geom(element, shape, position, names[id(shape)])
    _sites(elements, robot)
    custom = _custom(robot, world)
    if len(custom):
        model.insert(2, custom)
    actuator = ET.SubElement(model, "actuator")
    for name in top.joint_names:
        ET.SubElement(actuator, "motor", name=safe_name(name), joint=safe_name(name))
    return xml_text(model)


def _custom(robot: Robot, world: ET.Element) -> ET.Element:
    """Limits of rate and acceleration, and the order of joints and sites where the text has another."""
    custom = ET.Element("custom")
    for kind, tag, names in (
        ("joint_number", "joint", robot.joint_names),
        ("end_effector_number", "site", robot.end_effector_names),
    ):
        safe = [safe_name(name) for name in names]
        if [element.get("name") for element in world.iter(tag)] != safe:
            for number, name in enumerate(safe):
                ET.SubElement(custom, "numeric", name=f"{kind}:{name}", data=str(number))
    for kind in ("velocity", "acceleration"):
        for name, value in zip(robot.joint_names, getattr(robot.limits, kind), strict=True):
            if np.isfinite(value):
                ET.SubElement(custom, "numeric", name=f"{kind}_limit:{safe_name(name)}", data=decimal(value))
    return custom


def _place(element: ET.Element, position, rotation) -> None:
    element.set("pos", decimals(position))
    element.set("quat", decimals(matrix_to_quaternion(rotation)))


def _joint(element: ET.Element, robot: Robot, joint: int) -> None:
    position = np.asarray(robot.joint_position[joint])
    if robot.topology.parents[joint] == 0:
        position = position - np.asarray(robot.root_position)
    _place(element, position, robot.joint_rotation[joint])
    limits = robot.limits
    attributes = {
        "name": safe_name(robot.joint_names[joint]),
        "type": "hinge" if robot.topology.joint_types[joint] == REVOLUTE else "slide",
        "axis": decimals(robot.joint_axis[joint]),
    }
    low, high = float(limits.position_lower[joint]), float(limits.position_upper[joint])
    if np.isfinite(low) or np.isfinite(high):
        attributes |= {"limited": "true", "range": decimals(np.clip([low, high], -_WIDEST, _WIDEST))}
    torque = float(limits.torque[joint])
    if np.isfinite(torque):
        attributes |= {"actuatorfrclimited": "true", "actuatorfrcrange": decimals([-torque, torque])}
    ET.SubElement(element, "joint", attributes)


def _inertial(element: ET.Element, robot: Robot, body: int) -> None:
    com = -np.asarray(robot.root_position) if body == 0 else robot.link_com[body - 1]
    moments, axes = principal_axes(robot.inertia[body])
    inertial = ET.SubElement(element, "inertial", mass=decimal(robot.mass[body]))
    _place(inertial, com, axes)
    inertial.set("diaginertia", decimals(moments))


def _geom(element: ET.Element, shape: Shape, position: np.ndarray, name: str) -> None:
    geom = ET.SubElement(element, "geom", name=name, type=shape.kind, mass="0")
    _place(geom, position, shape.rotation)
    if shape.kind == MESH:
        geom.set("mesh", name)
    else:
        geom.set("size", decimals(shape.size))
    if COLLISION not in shape.roles:
        geom.set("group", str(_VISUAL_GROUP))
        geom.set("contype", "0")
        geom.set("conaffinity", "0")
    elif VISUAL not in shape.roles:
        geom.set("group", str(COLLISION_GROUP))
    if shape.colour is not None:
        geom.set("rgba", decimals(shape.colour))


def _sites(elements: list[ET.Element], robot: Robot) -> None:
    for number, name in enumerate(robot.end_effector_names):
        body = robot.topology.end_effector_bodies[number]
        position = np.asarray(robot.end_effector_position[number])
        if body == 0:
            position = position - np.asarray(robot.root_position)
        site = ET.SubElement(elements[body], "site", name=safe_name(name))
        _place(site, position, robot.end_effector_rotation[number])
