"""Signed distances between the bodies of a robot, and between them and a free target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import NamedTuple

import jax
import numpy as np

from jffsr.clearance.boxes import box_box_distance
from jffsr.clearance.cores import box_segment_distance, segment_segment_distance
from jffsr.clearance.joined import always_touching
from jffsr.clearance.numerics import arrays_for, computed_once, module_for
from jffsr.clearance.pairs import body_names, body_pairs
from jffsr.clearance.placed import place
from jffsr.clearance.solids import BOX_CORE, SEGMENT_CORE, Solid, solid_of
from jffsr.errors import InputError
from jffsr.robots.geometry import COLLISION, Geometry
from jffsr.robots.robot import Robot, Topology
from jffsr.spatial.components import Components, Rows
from jffsr.types import Array

CAPSULES, EXACT = "capsules", "exact"
ARMS = (CAPSULES, EXACT)


class SolidNumbers(NamedTuple):
    """The numbers of all solids, (k, ...), as in `Solid`."""

    centre: Array
    axes: Array
    half: Array
    radius: Array
    slack: Array
    box: Array
    ball: Array
    ellipsoid: Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class ClearanceModel:
    """Signed distances, m, of all pairs of bodies that can meet, from their collision shapes.

    `pair_names` (p,) are the names of the bodies, base first, target last. A distance is never more than that of the
    shapes: exact, but for rounding, between boxes, spheres and capsules, on the low side between cylinders and
    ellipsoids; a mesh counts as the box around it. Where bodies overlap it is minus the way that parts them, or more.
    The numbers are leaves; which solids there are and which pairs are formed is static.
    """

    numbers: SolidNumbers
    bodies: tuple[int, ...] = field(metadata={"static": True})
    segment_pairs: tuple[tuple[int, int], ...] = field(metadata={"static": True})
    box_segment_pairs: tuple[tuple[int, int], ...] = field(metadata={"static": True})
    box_pairs: tuple[tuple[int, int], ...] = field(metadata={"static": True})
    members: tuple[tuple[int, ...], ...] = field(metadata={"static": True})
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
        model = cls.of_solids(robot.topology, by_body, pairs)
        joined = always_touching(model, robot)
        left = [pair for pair, touching in zip(pairs, joined, strict=True) if not touching]
        if not left:
            raise InputError(f"clearance: robot '{robot.name}' has no two bodies with shapes that can meet")
        return cls.of_solids(robot.topology, by_body, left)

    @classmethod
    def of_solids(
        cls, topology: Topology, by_body: dict[int, list[Solid]], pairs: list[tuple[int, int]]
    ) -> ClearanceModel:
        """The model of these pairs of bodies, whose solids are given by the body's number."""
        names, target = body_names(topology), len(topology.body_names)
        solids = [solid for found in by_body.values() for solid in found]
        place_of = {id(solid): k for k, solid in enumerate(solids)}
        kinds: dict[tuple[str, str], list[tuple[int, int]]] = {}
        owners: dict[tuple[str, str], list[int]] = {}
        for owner, (one, other) in enumerate(pairs):
            for a in by_body[one]:
                for b in by_body[other]:
                    # In the order of the names: a box before a segment.
                    first, second = sorted((a, b), key=lambda solid: solid.core)
                    kind = (first.core, second.core)
                    kinds.setdefault(kind, []).append((place_of[id(first)], place_of[id(second)]))
                    owners.setdefault(kind, []).append(owner)
        order = ((SEGMENT_CORE, SEGMENT_CORE), (BOX_CORE, SEGMENT_CORE), (BOX_CORE, BOX_CORE))
        owner_of = [owner for kind in order for owner in owners.get(kind, [])]
        members = [
            tuple(k for k, owner in enumerate(owner_of) if owner == pair) for pair in range(len(pairs))
        ]
        numbers = SolidNumbers(
            *(np.array([getattr(s, name) for s in solids], dtype=float) for name in SolidNumbers._fields)
        )
        return cls(
            numbers,
            tuple(solid.body for solid in solids),
            *(tuple(kinds.get(kind, ())) for kind in order),
            tuple(members),
            tuple((names[a], names[b]) for a, b in pairs),
            target in by_body,
        )

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
        return xp.moveaxis(self.distances(xp, origin, rows), 0, -1)

    def check_target(self, given: bool) -> None:
        """InputError unless a pose of the target is given exactly where the model has a target."""
        if given != self.has_target:
            has, gets = ("a", "no") if self.has_target else ("no", "a")
            raise InputError(f"clearance: the model has {has} target, and {gets} pose of a target was given")

    def distances(self, xp: ModuleType, position: Components, rotation: Rows) -> Array:
        """Signed distances (p, ...), m, of bodies at (b, ...), the target after the robot's."""
        numbers = arrays_for(xp, self.numbers)
        solids = computed_once(xp, place(numbers, np.array(self.bodies), position, rotation))
        found = []
        for pairs, distance in (
            (self.segment_pairs, segment_segment_distance),
            (self.box_segment_pairs, box_segment_distance),
            (self.box_pairs, box_box_distance),
        ):
            if pairs:
                chosen = np.array(pairs)
                a, b = (jax.tree.map(lambda x, i=chosen[:, end]: x[i], solids) for end in (0, 1))
                found.append(distance(xp, *computed_once(xp, (a, b))))
        every = computed_once(xp, xp.concatenate(found))
        # The nearest of each pair's solids; shorter lists are filled up with their first.
        most = max(len(member) for member in self.members)
        table = np.array([[*m, *m[:1] * (most - len(m))] for m in self.members])
        nearest = every[table[:, 0]]
        for column in range(1, most):
            other = every[table[:, column]]
            nearest = xp.where(other < nearest, other, nearest)
        return nearest
