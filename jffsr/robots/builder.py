"""From a description to a robot: every physical check, the tree, the lumping of fixed links, the parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.robots.checks import check_joint, check_link, check_names, check_pose, check_shape
from jffsr.robots.composing.joining import join
from jffsr.robots.composing.seat import ROOT, Seat, end_effector_seat, find_seat
from jffsr.robots.description import (
    FIXED,
    ArmDescription,
    JointDescription,
    LinkDescription,
    PayloadDescription,
    RobotDescription,
)
from jffsr.robots.geometry import Geometry
from jffsr.robots.lumping import Part, lump
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Limits, Robot, Topology


def build_robot(description: RobotDescription) -> Robot:
    """Check a description and build the robot; InputError names file, body and reason."""
    where = description.origin
    for link in description.links:
        check_link(where, link)
    for joint in description.joints:
        check_joint(where, joint)
    check_names(description)
    order = _tree_order(description)
    with np.errstate(over="ignore", invalid="ignore"):
        robot, seats = _assemble(description, order)
        for number, arm in enumerate(description.arms):
            robot = _with_arm(robot, arm, seats, f"{where}: arms.{number}")
        for number, payload in enumerate(description.payloads):
            robot = _with_payload(robot, payload, f"{where}: payloads.{number}")
    if not robot.num_joints:
        raise InputError(f"{where}: the robot has no revolute or prismatic joint")
    _check_range(robot, where)
    return robot


def _check_range(robot: Robot, where: str) -> None:
    """Refuse a body whose parts are so far apart, or so heavy, that its inertia has no number."""
    for body, inertia in zip(robot.body_names, robot.inertia, strict=True):
        if not np.all(np.isfinite(inertia)):
            raise InputError(
                f"{where}: link '{body}': the inertia of what is fixed to it is too large a number; "
                f"distances in m and masses in kg are expected"
            )


def _with_arm(robot: Robot, arm: ArmDescription, links: dict[str, Seat], place: str) -> Robot:
    """The robot with one of its arms; its own links are seats also where they are lumped away."""

    def at(key: str) -> str:
        return arm.places.get(key, f"{place}.{key}")

    check_pose(at, arm.position, arm.rotation)
    seat = find_seat(robot, arm.link, at("link"), links).then(arm.position, arm.rotation)
    return join(robot, build_robot(arm.robot), seat, at("prefix"), arm_base=arm.base, prefix=arm.prefix)


def _with_payload(robot: Robot, payload: PayloadDescription, place: str) -> Robot:
    """The robot with a rigid body in one of its tools."""

    def at(key: str) -> str:
        return payload.places.get(key, f"{place}.{key}".rstrip("."))

    check_pose(at, payload.position, payload.rotation)
    link, tools = payload.body, robot.end_effector_names
    if payload.end_effector not in tools:
        raise InputError(
            f"{at('end_effector')}: found '{payload.end_effector}', which '{robot.name}' does not have"
            f"{hint(payload.end_effector, tools)} (it has {', '.join(tools) or 'none'})"
        )
    check_link(at(""), link)
    for shape in payload.shapes:
        check_shape(f"{at('shapes')}: shape '{shape.name}'", shape)
    seat = end_effector_seat(robot, tools.index(payload.end_effector))
    body = RigidBody(link.mass, link.com, link.inertia, link.name, Geometry(payload.shapes))
    return join(robot, body, seat.then(payload.position, payload.rotation), at("end_effector"))


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


def _assemble(description: RobotDescription, order: list[JointDescription]) -> tuple[Robot, dict[str, Seat]]:
    """The robot without its arms, and where each link's frame sits."""
    links = {link.name: link for link in description.links}
    names = [description.links[0].name]
    seats = {names[0]: ROOT}
    moving = [joint for joint in order if joint.type != FIXED]
    parents, positions, rotations = [], [], []
    for joint in order:
        seat = seats[joint.parent].then(joint.position, joint.rotation)
        if joint.type == FIXED:
            seats[joint.child] = seat
            continue
        parents.append(seat.body)
        positions.append(seat.position)
        rotations.append(seat.rotation)
        seats[joint.child] = Seat(len(names), np.zeros(3), np.eye(3))
        names.append(joint.child)

    bodies: list[list[Part]] = [[] for _ in names]
    for name, seat in seats.items():
        if links[name].mass is not None:
            bodies[seat.body].append(_part(links[name], seat))
    for name, parts in zip(names, bodies, strict=True):
        if not parts:
            raise InputError(
                f"{description.origin}: link '{name}' moves and has no inertia, nor has any link fixed to "
                f"it; a mass and an inertia are needed"
            )
    lumped = [lump(parts) for parts in bodies]
    base_com = lumped[0][1]
    tools = [seats[tool.link].then(tool.position, tool.rotation) for tool in description.end_effectors]

    def from_base_com(body: int, position: np.ndarray) -> np.ndarray:
        return position - base_com if body == 0 else position

    shapes = []
    for shape in description.shapes:
        body, position, rotation = seats[shape.body].then(shape.position, shape.rotation)
        position = from_base_com(body, position)
        shapes.append(replace(shape, body=names[body], position=position, rotation=rotation))

    n = len(moving)
    robot = Robot(
        mass=np.array([part[0] for part in lumped]),
        inertia=np.array([part[2] for part in lumped]),
        link_com=np.array([part[1] for part in lumped[1:]]).reshape(n, 3),
        joint_position=np.array([from_base_com(parents[i], positions[i]) for i in range(n)]).reshape(n, 3),
        joint_rotation=np.array(rotations).reshape(n, 3, 3),
        joint_axis=np.array([joint.axis / np.linalg.norm(joint.axis) for joint in moving]).reshape(n, 3),
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
            body_names=tuple(names),
            end_effector_names=tuple(tool.name for tool in description.end_effectors),
            end_effector_bodies=tuple(tool.body for tool in tools),
        ),
        geometry=Geometry(tuple(shapes)),
    )
    return robot, seats


def _part(link: LinkDescription, seat: Seat) -> Part:
    rotation = seat.rotation
    return link.mass, seat.position + rotation @ link.com, rotation @ link.inertia @ rotation.T
