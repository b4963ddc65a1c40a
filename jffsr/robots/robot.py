"""The robot: a pytree whose numbers are traced and whose topology and names are static."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.geometry import Geometry
from jffsr.types import Array

REVOLUTE = "revolute"
PRISMATIC = "prismatic"


@dataclass(frozen=True)
class Topology:
    """What cannot be traced: the tree, the joint types and the names.

    `parents[i]` is the body that joint i hangs from, 0 for the base; joint i moves body i + 1, and
    parents[i] <= i. `end_effector_bodies[k]` is the body that carries end effector k.
    """

    name: str
    parents: tuple[int, ...]
    joint_types: tuple[str, ...]
    joint_names: tuple[str, ...]
    body_names: tuple[str, ...]
    end_effector_names: tuple[str, ...]
    end_effector_bodies: tuple[int, ...]

    @property
    def support(self) -> np.ndarray:
        """Boolean (b, n): whether joint j lies on the path from the base to body i."""
        mask = np.zeros((len(self.parents) + 1, len(self.parents)), dtype=bool)
        for joint, parent in enumerate(self.parents):
            mask[joint + 1] = mask[parent]
            mask[joint + 1, joint] = True
        return mask

    @property
    def chains(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """The tree as unbranched chains: the body each hangs from, and its joints from there outwards."""
        chains: list[tuple[int, list[int]]] = []
        tips: dict[int, int] = {}
        for joint, parent in enumerate(self.parents):
            if parent in tips:
                number = tips.pop(parent)
                chains[number][1].append(joint)
            else:
                number = len(chains)
                chains.append((parent, [joint]))
            tips[joint + 1] = number
        return tuple((parent, tuple(joints)) for parent, joints in chains)

    @property
    def is_revolute(self) -> np.ndarray:
        """Boolean (n,): whether joint j is revolute; the others are prismatic."""
        return np.array([kind == REVOLUTE for kind in self.joint_types], dtype=bool)


@register_dataclass
@dataclass(frozen=True)
class Limits:
    """Joint limits, shape (n,) each, in rad and m; infinite where there is none."""

    position_lower: Array
    position_upper: Array
    velocity: Array
    acceleration: Array
    torque: Array

    @classmethod
    def symmetric(
        cls,
        num_joints: int,
        position: float = np.inf,
        velocity: float = np.inf,
        acceleration: float = np.inf,
        torque: float = np.inf,
    ) -> Limits:
        """The same limits for every joint, positions in [-position, position]."""
        bounds = (-position, position, velocity, acceleration, torque)
        return cls(*(np.full(num_joints, float(bound)) for bound in bounds))


@register_dataclass
@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of rigid bodies on a free base.

    mass (b,), kg; inertia (b, 3, 3), kg m^2, about each body's centre of mass in the axes of its frame;
    link_com (n, 3), m, centre of mass of body i + 1 in its frame, whose origin is at its joint (the base
    frame sits at the base's centre of mass, so the base has none). joint_position (n, 3), m, and
    joint_rotation (n, 3, 3) place the joint frame in the parent body's frame at joint position zero;
    joint_axis (n, 3) is a unit vector in the joint frame. end_effector_position (m, 3) and
    end_effector_rotation (m, 3, 3) place the end effectors in the frames of their bodies. root_position
    (3,) is the origin of the file's root link in B. All are differentiable; after a gradient step,
    joint_axis and the rotations must be normalised again. `topology` and `geometry`, the shapes for drawing
    and clearance in the frames of their bodies, are static.
    """

    mass: Array
    inertia: Array
    link_com: Array
    joint_position: Array
    joint_rotation: Array
    joint_axis: Array
    end_effector_position: Array
    end_effector_rotation: Array
    root_position: Array
    limits: Limits
    topology: Topology = field(metadata={"static": True})
    geometry: Geometry = field(default_factory=Geometry, metadata={"static": True})

    @property
    def name(self) -> str:
        """The catalogue name, or the one in the file."""
        return self.topology.name

    @property
    def num_joints(self) -> int:
        """Number of joints that carry a coordinate, n."""
        return len(self.topology.parents)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints that carry a coordinate, in coordinate order."""
        return self.topology.joint_names

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies; the base comes first."""
        return self.topology.body_names

    @property
    def end_effector_names(self) -> tuple[str, ...]:
        """Names of the end effectors, in file order."""
        return self.topology.end_effector_names

    def end_effector_index(self, name: str | None) -> int:
        """Index of the named end effector, the first for None; InputError if there is none of that name."""
        names = self.end_effector_names
        if name is None and names:
            return 0
        if name not in names:
            raise InputError(f"robot '{self.name}' has no end effector '{name}'; it has {list(names)}")
        return names.index(name)

    def replace(self, **changes: Any) -> Robot:
        """A copy with some fields exchanged."""
        return replace(self, **changes)
