"""The section `target`: the body that is grasped, how it moves when the robot starts, and where it may be grasped."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import model_validator

from jffsr.reading.section import Section
from jffsr.reading.values import conflict, either, number, sequence, text
from jffsr.robots.shape_schema import ShapeModel
from jffsr.study.schema_task import Number, Vector3

Positive = Annotated[float, number(gt=0)]
# Its length is looked at by the target, which makes it unit, and refuses what is far from it.
Quaternion = Annotated[tuple[Number, ...], sequence("a list of 4 numbers (w, x, y, z)", 4, 4)]
GraspName = Annotated[str, text(r"[A-Za-z0-9 _:-]{1,60}", "a name of at most 60 letters and digits")]
_Row = Annotated[tuple[Number, ...], sequence("a row of 3 numbers", 3, 3)]
Inertia = either(
    Annotated[
        tuple[Positive, ...], sequence("a list of 3 principal moments, or a matrix of 3 rows of 3,", 3, 3)
    ],
    Annotated[tuple[_Row, ...], sequence("a list of 3 principal moments, or a matrix of 3 rows of 3,", 3, 3)],
    lambda value: isinstance(value, list | tuple) and any(isinstance(row, list | tuple) for row in value),
)


class Attitude(Section):
    """An attitude: a quaternion, or a rotation vector (axis times angle); neither is no turn."""

    units: ClassVar = ("rotation_vector",)

    quaternion: Quaternion | None = None
    rotation_vector_deg: Vector3 | None = None
    rotation_vector: Vector3 | None = None

    @model_validator(mode="after")
    def _one_attitude(self) -> Attitude:
        self.check_units()
        if self.quaternion is not None and self.si("rotation_vector") is not None:
            key = self.key_of("rotation_vector")
            raise conflict(
                f"both 'quaternion' and '{key}' are given, keep one (or set the other to null)", key
            )
        return self


class Frame(Attitude):
    """A frame fixed to the target, in T: its origin, m, and its attitude, frame to T."""

    position: Vector3 = (0.0, 0.0, 0.0)


class Target(Attitude):
    """A free rigid body and its motion when the robot starts; T has its origin in the centre of mass.

    inertia in kg m^2 or any multiple of it, in the axes of T; position, m, and velocity, m/s, in I; attitude T to I;
    angular velocity in T.
    """

    units: ClassVar = ("rotation_vector", "angular_velocity")

    mass: Positive = 300.0  # kg, which only MuJoCo and the contact ask for
    inertia: Inertia
    position: Vector3
    velocity: Vector3 = (0.0, 0.0, 0.0)
    angular_velocity_deg: Vector3 | None = None
    angular_velocity: Vector3 | None = None
    marker: Frame = Frame()  # the frame whose pose a camera measures
    grasps: dict[GraspName, Frame]
    shapes: Annotated[tuple[ShapeModel, ...], sequence("a list of at most 100 shapes", 0, 100)] = ()

    @model_validator(mode="after")
    def _check(self) -> Target:
        self.check_units("angular_velocity")
        if not self.grasps:
            raise conflict("found no grasp frame, at least one by its name is expected", "grasps")
        return self

    @property
    def has_solids(self) -> bool:
        """Whether a shape is kept clear of."""
        return any(shape.role != "visual" for shape in self.shapes)
