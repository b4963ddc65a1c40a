"""A robot as its file describes it, before any check: plain data, no arrays traced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from jffsr.robots.geometry import Shape

FIXED = "fixed"


@dataclass(frozen=True)
class LinkDescription:
    """A rigid link: mass in kg, centre of mass (3,) in the link frame, inertia (3, 3) about it.

    A link whose mass is None is a bare frame: it adds nothing to the body that it belongs to.
    """

    name: str
    mass: float | None
    com: np.ndarray
    inertia: np.ndarray

    @classmethod
    def frame(cls, name: str) -> LinkDescription:
        """A bare frame."""
        return cls(name, None, np.zeros(3), np.zeros((3, 3)))


@dataclass(frozen=True)
class JointDescription:
    """A joint: its frame in the parent link's frame, its axis in the joint frame, its limits."""

    name: str
    type: str
    parent: str
    child: str
    position: np.ndarray
    rotation: np.ndarray
    axis: np.ndarray
    position_limit: tuple[float, float] = (-np.inf, np.inf)
    velocity_limit: float = np.inf
    acceleration_limit: float = np.inf
    torque_limit: float = np.inf


@dataclass(frozen=True)
class EndEffectorDescription:
    """A tool frame in the frame of its link."""

    name: str
    link: str
    position: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class ArmDescription:
    """A robot whose root link's frame stands in that of a link or end effector, None the root link.

    base says whether its own base comes with it ("keep") or not ("drop"), prefix what goes before its names;
    places, by key, where a message should point.
    """

    robot: RobotDescription
    position: np.ndarray
    rotation: np.ndarray
    link: str | None = None
    base: str = "keep"
    prefix: str = ""
    places: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class PayloadDescription:
    """A rigid body whose frame stands in that of an end effector, and its shapes in its own frame."""

    body: LinkDescription
    end_effector: str
    position: np.ndarray
    rotation: np.ndarray
    shapes: tuple[Shape, ...] = ()
    places: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class RobotDescription:
    """A whole robot and where it comes from; the first link is the root.

    Arms are put on in their order, on what is there by then; payloads after them.
    """

    name: str
    origin: str
    links: tuple[LinkDescription, ...]
    joints: tuple[JointDescription, ...]
    end_effectors: tuple[EndEffectorDescription, ...]
    shapes: tuple[Shape, ...] = ()  # placed in the frames of their links
    arms: tuple[ArmDescription, ...] = ()
    payloads: tuple[PayloadDescription, ...] = ()
    aliases: tuple[str, ...] = ()
    description: str = ""
    source: str = ""
    license: str = ""
    notes: str = ""
    extra: dict = field(default_factory=dict)
