"""Robots out of parts: an arm on a base or on another arm, and a captured target in a tool."""

from __future__ import annotations

import numpy as np

from jffsr.errors import InputError
from jffsr.robots.composing.joining import DROP, KEEP, join
from jffsr.robots.composing.seat import end_effector_seat, find_seat
from jffsr.robots.lumping import on_host, quaternion_rotation, to_array
from jffsr.robots.rigid_body import RigidBody
from jffsr.robots.robot import Robot
from jffsr.types import Matrix3, Quaternion, Vector3


def attach(
    host: Robot | RigidBody,
    arm: Robot,
    *,
    position: Vector3 = (0.0, 0.0, 0.0),
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0),
    link: str | None = None,
    arm_base: str = KEEP,
    prefix: str = "",
    name: str | None = None,
) -> Robot:
    """The host with an arm on it, as one robot: the host's joints, then the arm's.

    `position` (3,), m, and `quaternion` (4,), of any length, place the frame of the arm's root link in that
    of the host's root link (a rigid body's own frame), or in that of the host's end effector, else of its
    body, named `link`. arm_base "keep" makes the arm's base, with its shapes and end effectors, part of the
    body that it stands on; "drop" leaves it out, to move an arm from its satellite to another. B stays at
    the base's centre of mass, in the axes of the host's root link; other bodies keep their frames. `prefix`
    goes before the names of the arm's joints, bodies, end effectors and shapes; `name` is that of the whole,
    None the host's.

    Every number is differentiable, also under `jax.jit` and `jax.vmap`; from NumPy data come float64 NumPy
    leaves. A shape whose place depends on a traced number is left out: those of the arm's base where the pose
    is traced, and all of the base's where its new centre of mass is. InputError for an unknown link and for
    names that the two share.
    """
    if not isinstance(host, Robot | RigidBody):
        raise InputError(f"attach: the host is a {type(host).__name__}; a Robot or a RigidBody is expected")
    if not isinstance(arm, Robot):
        advice = "; a RigidBody is joined on by jffsr.weld" if isinstance(arm, RigidBody) else ""
        raise InputError(f"attach: the arm is a {type(arm).__name__}; a Robot is expected{advice}")
    where = f"robot '{arm.name}' on '{host.name}'"
    if arm_base not in (KEEP, DROP):
        raise InputError(f"{where}: arm_base is {arm_base!r}; allowed are 'keep' and 'drop'")
    base = host.without_joints() if isinstance(host, RigidBody) else host
    seat = find_seat(base, link, f"{where}: link").then(*_pose(position, quaternion, where))
    return join(host, arm, seat, where, arm_base=arm_base, prefix=prefix, name=name)


def weld(
    robot: Robot,
    target: RigidBody,
    *,
    end_effector: str | None = None,
    position: Vector3 = (0.0, 0.0, 0.0),
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0),
    name: str | None = None,
) -> Robot:
    """The robot with a captured target, which becomes part of the body that carries the end effector.

    `position` (3,), m, and `quaternion` (4,), of any length, place the target's frame in that of the named end
    effector, None the first. Joints, end effectors and their names stay; `name` is that of the whole, None
    the robot's. The compound's momentum is the sum of both at the instant of capture, so the base twist
    after it follows from `jffsr.base_twist`. Differentiable as `jffsr.attach` is. InputError if there is no
    such end effector.
    """
    if not isinstance(robot, Robot) or not isinstance(target, RigidBody):
        found = f"a {type(robot).__name__} and a {type(target).__name__}"
        raise InputError(f"weld: found {found}; a Robot and a RigidBody are expected")
    where = f"rigid body '{target.name}' on '{robot.name}'"
    index = robot.end_effector_index(end_effector)
    seat = end_effector_seat(robot, index).then(*_pose(position, quaternion, where))
    return join(robot, target, seat, where, name=name)


def _pose(position: Vector3, quaternion: Quaternion, where: str) -> tuple[Vector3, Matrix3]:
    """Position and rotation matrix, refused where they have numbers that place nothing."""
    position, quaternion = to_array(position), to_array(quaternion)
    for what, value, count in (("position", position, 3), ("quaternion", quaternion, 4)):
        if value.shape != (count,):
            raise InputError(f"{where}: {what} has shape {value.shape}; {count} numbers are expected")
        numbers = on_host(value)
        if numbers is not None and not np.all(np.isfinite(numbers[0])):
            raise InputError(f"{where}: {what} {numbers[0].tolist()} is not finite")
    numbers = on_host(quaternion)
    if numbers is not None and not np.any(numbers[0]):
        raise InputError(f"{where}: quaternion [0, 0, 0, 0] is no rotation")
    return position, quaternion_rotation(quaternion)
