"""Names, tree and shapes of two robots that become one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.composing.seat import Seat
from jffsr.robots.geometry import Geometry, Shape
from jffsr.robots.lumping import on_host
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Robot, Topology
from jffsr.types import Array, Matrix3, Vector3


def kept_tools(arm: Topology, keep: bool) -> list[int]:
    """The arm's end effectors that go with it: those of its base only where the base does."""
    return [i for i, body in enumerate(arm.end_effector_bodies) if keep or body]


def joined_topology(
    host: Topology, arm: Topology, body: int, keep: bool, prefix: str, name: str | None, where: str
) -> Topology:
    """Host first, then arm; InputError where the two share a name."""
    shift = len(host.parents)

    def moved(bodies: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(at + shift if at else body for at in bodies)

    tools = kept_tools(arm, keep)
    joined = {}
    for what, names, others in (
        ("a joint", host.joint_names, arm.joint_names),
        ("a body", host.body_names, arm.body_names[1:]),
        ("an end effector", host.end_effector_names, tuple(arm.end_effector_names[i] for i in tools)),
    ):
        others = tuple(prefix + other for other in others)
        shared = sorted(set(names) & set(others), key=others.index)
        if shared:
            raise InputError(
                f"{where}: both have {what} named '{shared[0]}'; give the arm a prefix that makes its names "
                f"differ, such as '{arm.name}_'"
            )
        joined[what] = (*names, *others)
    return Topology(
        name=host.name if name is None else name,
        parents=(*host.parents, *moved(arm.parents)),
        joint_types=(*host.joint_types, *arm.joint_types),
        joint_names=joined["a joint"],
        body_names=joined["a body"],
        end_effector_names=joined["an end effector"],
        end_effector_bodies=(
            *host.end_effector_bodies,
            *moved(tuple(arm.end_effector_bodies[i] for i in tools)),
        ),
    )


def joined_geometry(
    host: Robot | RigidBody, arm: Robot | RigidBody, seat: Seat, root: Array, keep: bool, prefix: str
) -> Geometry:
    """The shapes of both, with the host's root link at `root` in B.

    What would stand at a traced place is left out: geometry is static, and such a place has no number.
    """
    names = host.body_names if isinstance(host, Robot) else (host.name,)
    if isinstance(host, Robot) and (seat.body or not keep):
        shapes = list(host.geometry.shapes)
    else:
        base, moving = _shapes(host)
        shapes = [*_placed(base, names[0], root, np.eye(3)), *moving]
    base, moving = _shapes(arm)
    if keep:
        position = seat.position if seat.body else root + seat.position
        shapes += _renamed(_placed(base, names[seat.body], position, seat.rotation), prefix, "")
    return Geometry((*shapes, *_renamed(moving, prefix, prefix)))


def _shapes(part: Robot | RigidBody) -> tuple[tuple[Shape, ...], tuple[Shape, ...]]:
    """Shapes of the base, placed in the root link's frame, and those of the moving bodies."""
    if isinstance(part, RigidBody):
        return part.geometry.shapes, ()
    base = part.geometry.on_body(part.body_names[0])
    moving = tuple(shape for shape in part.geometry.shapes if shape.body != part.body_names[0])
    root = on_host(part.root_position)
    if root is None:
        return (), moving
    return tuple(replace(shape, position=shape.position - root[0]) for shape in base), moving


def _placed(shapes: Iterable[Shape], body: str, position: Vector3, rotation: Matrix3) -> list[Shape]:
    pose = on_host(position, rotation)
    if pose is None:
        return []
    position, rotation = pose
    return [
        replace(
            shape,
            body=body,
            position=position + rotation @ shape.position,
            rotation=rotation @ shape.rotation,
        )
        for shape in shapes
    ]


def _renamed(shapes: Iterable[Shape], name_prefix: str, body_prefix: str) -> list[Shape]:
    return [replace(s, name=name_prefix + s.name, body=body_prefix + s.body) for s in shapes]
