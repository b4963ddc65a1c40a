"""From a description to a robot: every physical check, the tree, the lumping of fixed links."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.description import FIXED, JointDescription, LinkDescription, RobotDescription
from jffsr.robots.geometry import KINDS, MESH, NUM_SIZES, Geometry, Shape
from jffsr.robots.robot import PRISMATIC, REVOLUTE, Limits, Robot, Topology

# Published tables are rounded: a triangle inequality may be missed by this share of the largest moment.
_TRIANGLE_SLACK = 1e-9
# Beside a length beyond this, in m, the others of a robot would be lost to rounding.
_LONGEST = 1e6


def build_robot(description: RobotDescription) -> Robot:
    """Check a description and build the robot; InputError names file, body and reason."""
    where = description.origin
    for link in description.links:
        check_link(where, link)
    for joint in description.joints:
        _check_joint(where, joint)
    _check_names(description)
    order = _tree_order(description)
    return _assemble(description, order)


def check_link(where: str, link: LinkDescription) -> None:
    """Refuse a link whose mass or inertia no rigid body can have."""
    body = f"{where}: link '{link.name}'"
    if link.mass is None:
        return
    if not np.isfinite(link.mass):
        raise InputError(f"{body}: mass is {link.mass}; a finite number of kg is expected")
    if link.mass <= 0:
        raise InputError(f"{body}: mass is {link.mass:g} kg; it must be positive")
    if not np.all(np.isfinite(link.com)):
        raise InputError(f"{body}: centre of mass {link.com.tolist()} is not finite")
    if np.abs(link.com).max() > _LONGEST:
        raise InputError(f"{body}: centre of mass {link.com.tolist()} m is farther than {_LONGEST:g} m")
    if not np.all(np.isfinite(link.inertia)):
        raise InputError(f"{body}: inertia {link.inertia.tolist()} is not finite")
    if not np.allclose(link.inertia, link.inertia.T, rtol=0, atol=1e-9 * np.abs(link.inertia).max()):
        raise InputError(f"{body}: inertia is not symmetric")
    moments = np.linalg.eigvalsh(link.inertia)
    if moments[0] <= 0:
        raise InputError(
            f"{body}: principal moments of inertia {_numbers(moments)} kg m^2; all must be positive"
        )
    if moments[0] + moments[1] < moments[2] * (1 - _TRIANGLE_SLACK):
        raise InputError(
            f"{body}: principal moments of inertia {_numbers(moments)} kg m^2 break the triangle "
            f"inequality: {moments[0]:g} + {moments[1]:g} is less than {moments[2]:g}, which no rigid body can have"
        )


def _numbers(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def _check_joint(where: str, joint: JointDescription) -> None:
    body = f"{where}: joint '{joint.name}'"
    if joint.type not in (REVOLUTE, PRISMATIC, FIXED):
        raise InputError(
            f"{body}: type '{joint.type}' is not supported; allowed are revolute, prismatic, fixed"
        )
    for what, value in (("position", joint.position), ("rotation", joint.rotation), ("axis", joint.axis)):
        if not np.all(np.isfinite(value)):
            raise InputError(f"{body}: {what} {np.asarray(value).tolist()} is not finite")
    if np.abs(joint.position).max() > _LONGEST:
        raise InputError(f"{body}: position {joint.position.tolist()} m is farther than {_LONGEST:g} m")
    if not _is_rotation(joint.rotation):
        raise InputError(f"{body}: rotation is not a rotation matrix")
    if joint.type != FIXED and np.linalg.norm(joint.axis) < 1e-12:
        raise InputError(f"{body}: axis {joint.axis.tolist()} has length zero")
    low, high = joint.position_limit
    if np.isnan(low) or np.isnan(high) or not low < high:
        raise InputError(
            f"{body}: position limits [{low:g}, {high:g}]; the lower must be less than the upper"
        )
    for what in ("velocity_limit", "acceleration_limit", "torque_limit"):
        value = getattr(joint, what)
        if not value > 0:
            raise InputError(f"{body}: {what.replace('_', ' ')} is {value:g}; it must be positive")


def _is_rotation(matrix: np.ndarray) -> bool:
    return np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-9) and bool(np.linalg.det(matrix) > 0)


def _check_names(description: RobotDescription) -> None:
    where = description.origin
    for what, items in (
        ("links", description.links),
        ("joints", description.joints),
        ("end effectors", description.end_effectors),
    ):
        counts = Counter(item.name for item in items)
        twice = [name for name, count in counts.items() if count > 1]
        if twice:
            raise InputError(f"{where}: two {what} are named '{twice[0]}'; names must differ")
    links = {link.name for link in description.links}
    for joint in description.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise InputError(f"{where}: joint '{joint.name}': {role} link '{name}' does not exist")
    for tool in description.end_effectors:
        if tool.link not in links:
            raise InputError(f"{where}: end effector '{tool.name}': link '{tool.link}' does not exist")
        if not np.all(np.isfinite(tool.position)) or not np.all(np.isfinite(tool.rotation)):
            raise InputError(f"{where}: end effector '{tool.name}': its pose is not finite")
        if not _is_rotation(tool.rotation):
            raise InputError(f"{where}: end effector '{tool.name}': rotation is not a rotation matrix")
    for shape in description.shapes:
        if shape.body not in links:
            raise InputError(f"{where}: shape '{shape.name}': link '{shape.body}' does not exist")
        _check_shape(f"{where}: link '{shape.body}': shape '{shape.name}'", shape)


def _check_shape(place: str, shape: Shape) -> None:
    if shape.kind not in KINDS:
        raise InputError(f"{place}: kind '{shape.kind}' is not known; allowed are {', '.join(KINDS)}")
    for what, value in (("position", shape.position), ("rotation", shape.rotation)):
        if not np.all(np.isfinite(value)):
            raise InputError(f"{place}: {what} {np.asarray(value).tolist()} is not finite")
    if not _is_rotation(shape.rotation):
        raise InputError(f"{place}: rotation is not a rotation matrix")
    count = NUM_SIZES[shape.kind]
    if shape.size.shape != (count,) or not np.all(np.isfinite(shape.size)) or np.any(shape.size <= 0):
        raise InputError(
            f"{place}: size {shape.size.tolist()}; a {shape.kind} needs {count} positive numbers"
        )
    if shape.kind != MESH:
        return
    if shape.vertices is None or shape.faces is None or not len(shape.vertices) or not len(shape.faces):
        raise InputError(f"{place}: the mesh has no vertices or no faces")
    if not np.all(np.isfinite(shape.vertices)):
        raise InputError(f"{place}: the mesh has vertices that are not finite")
    if shape.faces.min() < 0 or shape.faces.max() >= len(shape.vertices):
        raise InputError(f"{place}: the mesh has faces that name vertices it does not have")


def _tree_order(description: RobotDescription) -> list[JointDescription]:
    """Joints in file order, moved back only where a child stands before its parent."""
    where, root = description.origin, description.links[0].name
    parents = {}
    for joint in description.joints:
        if joint.child in parents:
            raise InputError(
                f"{where}: link '{joint.child}' has two parents (joints '{parents[joint.child].name}' and "
                f"'{joint.name}'); closed loops are not supported"
            )
        if joint.child == root:
            raise InputError(
                f"{where}: joint '{joint.name}' moves the root link '{root}'; closed loops are not supported"
            )
        parents[joint.child] = joint
    for link in description.links[1:]:
        seen, name = set(), link.name
        while name != root:
            if name in seen:
                raise InputError(
                    f"{where}: link '{link.name}' hangs in a loop of joints that never reaches the root"
                )
            seen.add(name)
            if name not in parents:
                raise InputError(
                    f"{where}: link '{name}' is an orphan: no joint connects it to the root '{root}'"
                )
            name = parents[name].parent
    placed, order, waiting = {root}, [], list(description.joints)
    while waiting:
        joint = next(joint for joint in waiting if joint.parent in placed)
        waiting.remove(joint)
        placed.add(joint.child)
        order.append(joint)
    return order


class _Body:
    """A moving body under construction: the links lumped into it, in its own frame."""

    def __init__(self, name: str):
        self.name = name
        self.parts: list[tuple[float, np.ndarray, np.ndarray]] = []

    def add(self, link: LinkDescription, position: np.ndarray, rotation: np.ndarray) -> None:
        if link.mass is None:
            return
        com = position + rotation @ link.com
        self.parts.append((link.mass, com, rotation @ link.inertia @ rotation.T))

    def lumped(self) -> tuple[float, np.ndarray, np.ndarray]:
        if len(self.parts) == 1:
            return self.parts[0]
        mass = sum(part[0] for part in self.parts)
        com = sum(part[0] * part[1] for part in self.parts) / mass
        inertia = np.zeros((3, 3))
        for part_mass, part_com, part_inertia in self.parts:
            d = part_com - com
            inertia += part_inertia + part_mass * (d @ d * np.eye(3) - np.outer(d, d))
        return mass, com, inertia


def _assemble(description: RobotDescription, order: list[JointDescription]) -> Robot:
    links = {link.name: link for link in description.links}
    root = description.links[0]
    bodies = [_Body(root.name)]
    bodies[0].add(root, np.zeros(3), np.eye(3))
    # Where each link's frame sits: the body it belongs to, and its pose in that body's frame.
    seat = {root.name: (0, np.zeros(3), np.eye(3))}
    moving = [joint for joint in order if joint.type != FIXED]
    parents, positions, rotations = [], [], []
    for joint in order:
        body, position, rotation = seat[joint.parent]
        position = position + rotation @ joint.position
        rotation = rotation @ joint.rotation
        if joint.type == FIXED:
            seat[joint.child] = (body, position, rotation)
            bodies[body].add(links[joint.child], position, rotation)
            continue
        parents.append(body)
        positions.append(position)
        rotations.append(rotation)
        seat[joint.child] = (len(bodies), np.zeros(3), np.eye(3))
        bodies.append(_Body(joint.child))
        bodies[-1].add(links[joint.child], np.zeros(3), np.eye(3))
    if not moving:
        raise InputError(f"{description.origin}: the robot has no revolute or prismatic joint")

    for body in bodies:
        if not body.parts:
            raise InputError(
                f"{description.origin}: link '{body.name}' moves and has no inertia, nor has any link fixed to "
                f"it; a mass and an inertia are needed"
            )
    lumped = [body.lumped() for body in bodies]
    base_com = lumped[0][1]
    tools = []
    for tool in description.end_effectors:
        body, position, rotation = seat[tool.link]
        tools.append((body, position + rotation @ tool.position, rotation @ tool.rotation))

    def from_base_com(body: int, position: np.ndarray) -> np.ndarray:
        return position - base_com if body == 0 else position

    shapes = []
    for shape in description.shapes:
        body, position, rotation = seat[shape.body]
        position = from_base_com(body, position + rotation @ shape.position)
        shapes.append(
            replace(shape, body=bodies[body].name, position=position, rotation=rotation @ shape.rotation)
        )

    n = len(moving)
    return Robot(
        mass=np.array([part[0] for part in lumped]),
        inertia=np.array([part[2] for part in lumped]),
        link_com=np.array([part[1] for part in lumped[1:]]),
        joint_position=np.array([from_base_com(parents[i], positions[i]) for i in range(n)]),
        joint_rotation=np.array(rotations),
        joint_axis=np.array([joint.axis / np.linalg.norm(joint.axis) for joint in moving]),
        end_effector_position=np.array([from_base_com(b, p) for b, p, _ in tools]).reshape(-1, 3),
        end_effector_rotation=np.array([r for _, _, r in tools]).reshape(-1, 3, 3),
        root_position=-base_com,
        limits=Limits(
            position_lower=np.array([joint.position_limit[0] for joint in moving], dtype=float),
            position_upper=np.array([joint.position_limit[1] for joint in moving], dtype=float),
            velocity=np.array([joint.velocity_limit for joint in moving], dtype=float),
            acceleration=np.array([joint.acceleration_limit for joint in moving], dtype=float),
            torque=np.array([joint.torque_limit for joint in moving], dtype=float),
        ),
        topology=Topology(
            name=description.name,
            parents=tuple(parents),
            joint_types=tuple(joint.type for joint in moving),
            joint_names=tuple(joint.name for joint in moving),
            body_names=tuple(body.name for body in bodies),
            end_effector_names=tuple(tool.name for tool in description.end_effectors),
            end_effector_bodies=tuple(body for body, _, _ in tools),
        ),
        geometry=Geometry(tuple(shapes)),
    )
