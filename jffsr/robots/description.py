"""A robot as its file describes it, before any check: plain data, no arrays traced."""

from __future__ import annotations

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
class RobotDescription:
    """A whole robot and where it comes from; the first link is the root."""

    name: str
    origin: str
    links: tuple[LinkDescription, ...]
    joints: tuple[JointDescription, ...]
    end_effectors: tuple[EndEffectorDescription, ...]
    shapes: tuple[Shape, ...] = ()  # placed in the frames of their links
    aliases: tuple[str, ...] = ()
    description: str = ""
    source: str = ""
    license: str = ""
    notes: str = ""
    extra: dict = field(default_factory=dict)
