"""One robot's root link put on a frame of another: the arithmetic behind every composition."""

from __future__ import annotations

import jax
import numpy as np

from jffsr.robots.composing.names_and_shapes import joined_geometry, joined_topology, kept_tools
from jffsr.robots.composing.seat import Seat
from jffsr.robots.lumping import array_module, lump, to_array
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Robot
from jffsr.types import Array

KEEP, DROP = "keep", "drop"


def join(
    host: Robot | RigidBody,
    arm: Robot | RigidBody,
    seat: Seat,
    where: str,
    *,
    arm_base: str = KEEP,
    prefix: str = "",
    name: str | None = None,
) -> Robot:
    """The arm's root link put on the host's seat: what `attach`, `weld` and robot files do."""
    a = host.without_joints() if isinstance(host, RigidBody) else host
    b = arm.without_joints() if isinstance(arm, RigidBody) else arm
    body, keep = seat.body, arm_base == KEEP
    topology = joined_topology(a.topology, b.topology, seat.body, keep, prefix, name, where)
    root = a.root_position if body == 0 else np.zeros(3)
    # The arm's frame B, whose axes are those of its root link, in the frame of the host's body.
    rotation = seat.rotation
    origin = root + seat.position - rotation @ b.root_position

    own_com = np.zeros(3) if body == 0 else a.link_com[body - 1]
    parts = [(a.mass[body], own_com, a.inertia[body])]
    if keep:
        parts.append((b.mass[0], origin, rotation @ b.inertia[0] @ rotation.T))
    mass, com, inertia = lump(parts)
    # How far B moves to the new centre of mass; all that is placed in it goes back as far.
    shift = com if body == 0 else np.zeros(3)
    root_position = a.root_position - shift

    def in_host(points: Array, parents: tuple[int, ...]) -> Array:
        return points - _on_base(parents) * shift if body == 0 and keep else points

    def in_arm(points: Array, parents: tuple[int, ...]) -> Array:
        return _choose(_on_base(parents), points @ rotation.T + (origin - shift), points)

    def turned(rotations: Array, parents: tuple[int, ...]) -> Array:
        return _choose(_on_base(parents)[:, None], rotation @ rotations, rotations)

    link_com = a.link_com if body == 0 else _with_row(a.link_com, body - 1, com)
    tools = np.array(kept_tools(b.topology, keep), dtype=int)
    carried = tuple(b.topology.end_effector_bodies[i] for i in tools)
    tool_position, tool_rotation = b.end_effector_position[tools], b.end_effector_rotation[tools]
    parents = b.topology.parents
    return Robot(
        mass=_concatenate(_with_row(a.mass, body, mass), b.mass[1:]),
        inertia=_concatenate(_with_row(a.inertia, body, inertia), b.inertia[1:]),
        link_com=_concatenate(link_com, b.link_com),
        joint_position=_concatenate(
            in_host(a.joint_position, a.topology.parents), in_arm(b.joint_position, parents)
        ),
        joint_rotation=_concatenate(a.joint_rotation, turned(b.joint_rotation, parents)),
        joint_axis=_concatenate(a.joint_axis, b.joint_axis),
        end_effector_position=_concatenate(
            in_host(a.end_effector_position, a.topology.end_effector_bodies), in_arm(tool_position, carried)
        ),
        end_effector_rotation=_concatenate(a.end_effector_rotation, turned(tool_rotation, carried)),
        root_position=root_position,
        limits=jax.tree.map(_concatenate, a.limits, b.limits),
        topology=topology,
        geometry=joined_geometry(host, arm, seat, root_position, keep, prefix),
    )


def _concatenate(first: Array, second: Array) -> Array:
    return array_module(first, second).concatenate([to_array(first), to_array(second)])


def _with_row(array: Array, index: int, row: Array) -> Array:
    """The array with another row in one place; what is not traced stays NumPy."""
    rows = [array[:index], to_array(row)[None], array[index + 1 :]]
    return array_module(rows).concatenate(rows)


def _on_base(parents: tuple[int, ...]) -> np.ndarray:
    return np.array(parents, dtype=int).reshape(-1, 1) == 0


def _choose(mask: np.ndarray, moved: Array, kept: Array) -> Array:
    return array_module(moved, kept).where(mask, moved, kept)
