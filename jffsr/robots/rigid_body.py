"""A rigid body without joints: a bus that arms are attached to, or a target that a tool has captured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from jffsr.errors import InputError
from jffsr.pytrees import register_dataclass
from jffsr.robots.checks import check_rigid, check_shape
from jffsr.robots.geometry import Geometry, Shape
from jffsr.robots.lumping import on_host, to_array
from jffsr.robots.robot import Limits, Robot, Topology
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True, eq=False)
class RigidBody:
    """A rigid body, all of whose numbers are differentiable.

    mass (), kg; com (3,), m, centre of mass in the body's frame; inertia (3, 3), kg m^2, about the centre of
    mass in the axes of that frame. `name` and `geometry`, the shapes in the body's frame, are static. The
    numbers are taken as they are: `RigidBody.create` checks them.
    """

    mass: Array
    com: Array
    inertia: Array
    name: str = field(default="body", metadata={"static": True})
    geometry: Geometry = field(default_factory=Geometry, metadata={"static": True})

    @classmethod
    def create(
        cls,
        mass: Array,
        inertia: Array,
        com: Array = (0.0, 0.0, 0.0),
        name: str = "body",
        shapes: Sequence[Shape] = (),
    ) -> RigidBody:
        """The checked body: mass in kg, inertia (3, 3) or its diagonal (3,) about the centre of mass, com (3,).

        Shapes are placed in the body's frame and go by its name. InputError says what no rigid body can be;
        traced numbers have no value yet and pass.
        """
        mass, com, inertia = to_array(mass), to_array(com), to_array(inertia)
        if inertia.shape == (3,):
            inertia = inertia[:, None] * np.eye(3)
        for what, value, shape in (("mass", mass, ()), ("com", com, (3,)), ("inertia", inertia, (3, 3))):
            if value.shape != shape:
                raise InputError(f"rigid body '{name}': {what} has shape {value.shape}, {shape} is expected")
        numbers = on_host(mass, com, inertia)
        if numbers is not None:
            check_rigid(f"rigid body '{name}'", *numbers)
        shapes = tuple(replace(shape, body=name) for shape in shapes)
        for shape in shapes:
            check_shape(f"rigid body '{name}': shape '{shape.name}'", shape)
        return cls(mass, com, inertia, name, Geometry(shapes))

    def without_joints(self) -> Robot:
        """The body's numbers as a robot of no joints, whose root link has the body's frame; shapes left out."""
        mass, com, inertia = to_array(self.mass), to_array(self.com), to_array(self.inertia)
        none, vectors, rotations = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3, 3))
        return Robot(
            mass=mass[None],
            inertia=inertia[None],
            link_com=vectors,
            joint_position=vectors,
            joint_rotation=rotations,
            joint_axis=vectors,
            end_effector_position=vectors,
            end_effector_rotation=rotations,
            root_position=-com,
            limits=Limits(none, none, none, none, none),
            topology=Topology(self.name, (), (), (), (self.name,), (), ()),
        )
