"""Frames that are fixed on a robot's bodies, for something to be put there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import Robot
from jffsr.types import Matrix3, Vector3


class Seat(NamedTuple):
    """A frame fixed on a body of a robot, placed in the body's frame; on the base, in that of the root link.

    The root link's frame stays where it is when the base frame B moves to a new centre of mass.
    """

    body: int
    position: Vector3
    rotation: Matrix3

    def then(self, position: Vector3, rotation: Matrix3) -> Seat:
        """The frame that stands so in this one."""
        return Seat(self.body, self.position + self.rotation @ position, self.rotation @ rotation)


ROOT = Seat(0, np.zeros(3), np.eye(3))


def end_effector_seat(robot: Robot, index: int) -> Seat:
    """The frame of an end effector."""
    body, position = robot.topology.end_effector_bodies[index], robot.end_effector_position[index]
    if body == 0:
        position = position - robot.root_position
    return Seat(body, position, robot.end_effector_rotation[index])


def find_seat(robot: Robot, link: str | None, where: str, links: Mapping[str, Seat] | None = None) -> Seat:
    """The frame of the end effector, else of the body, of that name; None is the root link.

    `links` are more that have a name, such as those that a file lumps together. InputError for any other.
    """
    if link is None:
        return ROOT
    tools, bodies = robot.end_effector_names, robot.body_names
    if link in tools:
        return end_effector_seat(robot, tools.index(link))
    seats = {bodies[0]: ROOT, **(links or {})}
    if link in seats:
        return seats[link]
    if link in bodies:
        return Seat(bodies.index(link), np.zeros(3), np.eye(3))
    names = tuple(dict.fromkeys((*tools, *bodies, *seats)))
    raise InputError(
        f"{where}: found {str(link)[:60]!r}, which '{robot.name}' does not have{hint(str(link), names)} "
        f"(it has {', '.join(names[:20])}{', ...' if len(names) > 20 else ''})"
    )
