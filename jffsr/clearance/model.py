"""Signed distances between the bodies of a robot, and between them and a free target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np

from jffsr.clearance.joined import always_touching
from jffsr.clearance.layout import Layout, SolidNumbers, lay_out
from jffsr.clearance.nearest import distances, nearest_distances
from jffsr.clearance.numerics import arrays_for, module_for
from jffsr.clearance.pairs import body_names, body_pairs
from jffsr.clearance.solids import Solid, solid_of
from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.geometry import COLLISION, Geometry
from jffsr.robots.robot import Robot, Topology
from jffsr.spatial.components import Components, Rows
from jffsr.types import Array

CAPSULES, EXACT = "capsules", "exact"
ARMS = (CAPSULES, EXACT)


@register_dataclass
@dataclass(frozen=True, eq=False)
class ClearanceModel:
    """Signed distances, m, of all pairs of bodies that can meet, from their collision shapes.

    `pair_names` (p,) are the names of the bodies, base first, target last. A distance is never more than that of the
    shapes: exact, but for rounding, between boxes, spheres and capsules, on the low side between cylinders and
    ellipsoids; a mesh counts as the box around it. Where bodies overlap it is minus the way that parts them, or more.
    The numbers are leaves; which solids there are and which pairs are formed is static.
    """

    numbers: SolidNumbers
    layout: Layout = field(metadata={"static": True})
    pair_names: tuple[tuple[str, str], ...] = field(metadata={"static": True})
    has_target: bool = field(metadata={"static": True})

    @classmethod
    def create(
        cls,
        robot: Robot,
        target_geometry: Geometry | None = None,
        *,
        ignore: Sequence[tuple[str, str]] = (),
        arm: str = CAPSULES,
    ) -> ClearanceModel:
        """The model of a robot's bodies, and of a target whose shapes are given in its frame T.

        Left out are a body and the one it hangs from, pairs of names in `ignore` (the target is "target"), and pairs
        that touch in all of 256 random postures within the joint limits, being joined by design. arm says what the
        moving bodies' boxes become: "capsules" around them, or "exact" boxes, which takes longer. Raises InputError for
        names that do not exist and for shapes of which none can meet.
        """
        if arm not in ARMS:
            raise InputError(f"clearance: arm is {arm!r}; allowed are {', '.join(ARMS)}")
        topology, target = robot.topology, len(robot.topology.body_names)
        by_body: dict[int, list[Solid]] = {}
        for number, name in enumerate(topology.body_names):
            capsules = arm == CAPSULES and number > 0
            shapes = robot.geometry.on_body(name, COLLISION)
            by_body[number] = [solid_of(shape, number, capsules) for shape in shapes]
        if target_geometry is not None:
            shapes = [s for s in target_geometry.shapes if COLLISION in s.roles]
            if not shapes:
                raise InputError("clearance: the target has no shape with the role 'collision'")
            by_body[target] = [solid_of(shape, target, False) for shape in shapes]
        pairs = body_pairs(topology, (b for b, solids in by_body.items() if solids), ignore)
        if pairs:
            joined = always_touching(cls.of_solids(robot.topology, by_body, pairs), robot)
            pairs = [pair for pair, touching in zip(pairs, joined, strict=True) if not touching]
        if not pairs:
            bare = [name for number, name in enumerate(body_names(topology)[:target]) if not by_body[number]]
            missing = (
                f"; shapes with the role 'collision' (in a URDF <collision>) are missing on {', '.join(bare)}"
                if bare
                else ""
            )
            raise InputError(f"robot '{robot.name}' has no two bodies with shapes that can meet{missing}")
        return cls.of_solids(robot.topology, by_body, pairs)

    @classmethod
    def of_solids(
        cls, topology: Topology, by_body: dict[int, list[Solid]], pairs: list[tuple[int, int]]
    ) -> ClearanceModel:
        """The model of these pairs of bodies, whose solids are given by the body's number."""
        layout, numbers = lay_out(by_body, pairs)
        names = body_names(topology)
        named = tuple((names[a], names[b]) for a, b in pairs)
        return cls(numbers, layout, named, len(topology.body_names) in by_body)

    def __call__(
        self,
        body_position: Array,
        body_rotation: Array,
        target_position: Array | None = None,
        target_rotation: Array | None = None,
    ) -> Array:
        """Signed distances (..., p), m, of bodies whose frames are at (..., b, 3), m, with rotations (..., b, 3, 3).

        target_position (..., 3), m, and target_rotation (..., 3, 3) are those of T; with them everything is in I.
        `Kinematics.origin` and `Kinematics.rotation` are of this form. Under `jit` it is traced, else NumPy does it.
        """
        given = (body_position, body_rotation, target_position, target_rotation)
        xp = module_for(self, given)
        position, rotation = xp.asarray(body_position), xp.asarray(body_rotation)
        self.check_target(target_position is not None and target_rotation is not None)
        if self.has_target:
            position = xp.concatenate([position, xp.asarray(target_position)[..., None, :]], axis=-2)
            rotation = xp.concatenate([rotation, xp.asarray(target_rotation)[..., None, :, :]], axis=-3)
        rows = tuple(tuple(xp.moveaxis(rotation[..., i, k], -1, 0) for k in range(3)) for i in range(3))
        origin = tuple(xp.moveaxis(position[..., i], -1, 0) for i in range(3))
        return xp.moveaxis(self.of_components(xp, origin, rows), 0, -1)

    def check_target(self, given: bool) -> None:
        """InputError unless a pose of the target is given exactly where the model has a target."""
        if given != self.has_target:
            has, gets = ("a", "no") if self.has_target else ("no", "a")
            raise InputError(f"clearance: the model has {has} target, and {gets} pose of a target was given")

    def of_components(self, xp: ModuleType, position: Components, rotation: Rows) -> Array:
        """Signed distances (p, ...), m, of bodies at (b, ...), the target after the robot's."""
        numbers = arrays_for(xp, self.numbers)
        if xp is np:
            return nearest_distances(np, self.layout, numbers, position, rotation)
        return distances(self.layout, numbers, position, rotation)
