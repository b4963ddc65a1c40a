"""The YAML form of a robot, typed: what a catalogue file may say."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr, model_validator

from jffsr.errors import InputError
from jffsr.reading.section import Section
from jffsr.reading.sources import Sources
from jffsr.reading.values import choice, conflict, sequence, text
from jffsr.robots.description import (
    FIXED,
    ArmDescription,
    EndEffectorDescription,
    JointDescription,
    LinkDescription,
    PayloadDescription,
    RobotDescription,
)
from jffsr.robots.geometry import COLLISION, VISUAL, Shape
from jffsr.robots.shape_schema import ORIGIN, Number, ShapeModel, Triple

Pair = Annotated[tuple[Number, ...], sequence("a pair [low, high]", 2, 2)]
Name = Annotated[str, text(r".{1,200}", "a name of at most 200 letters")]
Prose = Annotated[str, text(r"(?s).{0,10000}", "a text")]

_MOST = 1000


class InertiaModel(Section):
    """Elements of the inertia tensor about the centre of mass, link axes, kg m^2."""

    xx: Number
    yy: Number
    zz: Number
    xy: Number = 0.0
    xz: Number = 0.0
    yz: Number = 0.0

    def matrix(self) -> np.ndarray:
        """The tensor as a (3, 3) array."""
        return np.array(
            [[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]]
        )


class LinkModel(Section):
    """A rigid link."""

    name: Name
    mass: Number
    com: Triple = ORIGIN
    inertia: InertiaModel
    shapes: Annotated[tuple[ShapeModel, ...], sequence("a list of shapes", 0, _MOST)] = ()


class LimitsModel(Section):
    """Joint limits; each in rad or m, or, of a joint that turns, in degrees under the key that ends in _deg."""

    units: ClassVar = ("position", "rate", "acceleration")

    position: Pair | None = None
    position_deg: Pair | None = None
    rate: Number | None = None
    rate_deg: Number | None = None
    acceleration: Number | None = None
    acceleration_deg: Number | None = None
    torque: Number | None = None

    @model_validator(mode="after")
    def _check(self) -> LimitsModel:
        self.check_units()
        return self


class JointModel(Section):
    """A joint between two links."""

    name: Name
    type: Annotated[Literal["revolute", "prismatic", "fixed"], choice("revolute", "prismatic", "fixed")]
    parent: Name
    child: Name
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN
    axis: Triple | None = None
    limits: LimitsModel = LimitsModel()

    @model_validator(mode="after")
    def _check(self) -> JointModel:
        for quantity in LimitsModel.units:
            key = self.limits.key_of(quantity)
            if self.type == "prismatic" and key.endswith("_deg"):
                raise conflict(
                    f"given, but the joint slides; give '{quantity}', in SI units", f"limits.{key}"
                )
        return self


class EndEffectorModel(Section):
    """A tool frame fixed on a link."""

    name: Name
    link: Name
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN


class ArmModel(Section):
    """Another robot, put on a link or end effector of this one (default: the base)."""

    robot: Annotated[str, text(r".{1,1000}", "a robot's catalogue name, or the path of its file")]
    link: Name | None = None
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN
    base: Annotated[Literal["keep", "drop"], choice("keep", "drop")] = "keep"
    prefix: Annotated[str, text(r".{0,200}", "a text of at most 200 letters")] = ""


class PayloadModel(LinkModel):
    """A rigid body held by an end effector, which its frame is placed in."""

    end_effector: Name
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN


class RobotModel(Section):
    """A robot file."""

    name: Name
    aliases: Annotated[tuple[Name, ...], sequence("a list of names", 0, _MOST)] = ()
    description: Prose = ""
    source: Prose = ""
    license: Prose = ""
    notes: Prose = ""
    base: LinkModel
    links: Annotated[tuple[LinkModel, ...], sequence("a list of links", 0, _MOST)] = ()
    joints: Annotated[tuple[JointModel, ...], sequence("a list of joints", 0, _MOST)] = ()
    end_effectors: Annotated[tuple[EndEffectorModel, ...], sequence("a list of end effectors", 0, _MOST)] = ()
    arms: Annotated[tuple[ArmModel, ...], sequence("a list of arms", 0, _MOST)] = ()
    payloads: Annotated[tuple[PayloadModel, ...], sequence("a list of payloads", 0, _MOST)] = ()

    _sources: Sources = PrivateAttr(default_factory=Sources)

    def describe(
        self, origin: str, find_robot: Callable[[str], RobotDescription] | None = None
    ) -> RobotDescription:
        """The description that the builder checks; `origin` is the file's name in messages.

        `find_robot` gives the description of an arm's robot by its name or path; only arms need it.
        """
        return RobotDescription(
            name=self.name,
            origin=origin,
            links=tuple(_link(link) for link in (self.base, *self.links)),
            joints=tuple(_joint(joint) for joint in self.joints),
            end_effectors=tuple(
                EndEffectorDescription(t.name, t.link, np.array(t.position), rpy_deg_to_matrix(t.rpy_deg))
                for t in self.end_effectors
            ),
            shapes=tuple(
                _shape(shape, link.name, number)
                for link in (self.base, *self.links)
                for number, shape in enumerate(link.shapes)
            ),
            arms=tuple(self._arm(number, origin, find_robot) for number in range(len(self.arms))),
            payloads=tuple(self._payload(number, origin) for number in range(len(self.payloads))),
            aliases=self.aliases,
            description=self.description,
            source=self.source,
            license=self.license,
            notes=self.notes,
        )

    def _arm(self, number: int, origin: str, find_robot: Callable[[str], RobotDescription]) -> ArmDescription:
        arm, places = self.arms[number], self._places(f"arms.{number}", ArmModel, origin)
        try:
            robot = find_robot(arm.robot)
        except InputError as error:
            raise InputError(f"{places['robot']}: {error}") from None
        return ArmDescription(
            robot=robot,
            position=np.array(arm.position),
            rotation=rpy_deg_to_matrix(arm.rpy_deg),
            link=arm.link,
            base=arm.base,
            prefix=arm.prefix,
            places=places,
        )

    def _payload(self, number: int, origin: str) -> PayloadDescription:
        payload = self.payloads[number]
        return PayloadDescription(
            body=_link(payload),
            end_effector=payload.end_effector,
            position=np.array(payload.position),
            rotation=rpy_deg_to_matrix(payload.rpy_deg),
            shapes=tuple(_shape(shape, payload.name, i) for i, shape in enumerate(payload.shapes)),
            places=self._places(f"payloads.{number}", PayloadModel, origin),
        )

    def _places(self, entry: str, model: type[Section], origin: str) -> dict[str, str]:
        """File, line and key of an entry, under "", and of each of its keys."""
        places = {}
        for name in ("", *model.model_fields):
            key = f"{entry}.{name}" if name else entry
            mark = self._sources.mark(tuple(key.split(".")))
            places[name] = f"{mark.place if mark else origin}: {key}"
        return places


def rpy_deg_to_matrix(rpy_deg: tuple[float, ...]) -> np.ndarray:
    """R = Rz(yaw) Ry(pitch) Rx(roll) of three angles in degrees, exact at multiples of 90 degrees."""
    rotation = np.eye(3)
    for axis, angle in enumerate(rpy_deg):
        # The remainder is exact, so that many whole turns cost no digits.
        angle = math.fmod(angle, 360.0) if math.isfinite(angle) else math.nan
        c, s = _exact_cosine(angle), _exact_cosine(angle - 90)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(3)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        rotation = turn @ rotation
    return rotation


def _exact_cosine(degrees: float) -> float:
    # cos(pi/2) is 6e-17 in floating point, which would tilt every axis that a file states as parallel.
    if degrees % 90 == 0:
        return (1.0, 0.0, -1.0, 0.0)[int(degrees // 90) % 4]
    return float(np.cos(np.deg2rad(degrees)))


def _link(link: LinkModel) -> LinkDescription:
    return LinkDescription(link.name, link.mass, np.array(link.com, dtype=float), link.inertia.matrix())


def _shape(shape: ShapeModel, link: str, number: int) -> Shape:
    return Shape(
        name=f"{link}_{shape.type}_{number}",
        kind=shape.type,
        body=link,
        position=np.array(shape.position, dtype=float),
        rotation=rpy_deg_to_matrix(shape.rpy_deg),
        size=np.array(shape.size, dtype=float),
        roles=(VISUAL, COLLISION) if shape.role == "both" else (shape.role,),
        colour=shape.colour,
    )


def _joint(joint: JointModel) -> JointDescription:
    limits = joint.limits
    low, high = _given(limits, "position", (-np.inf, np.inf))
    axis = joint.axis if joint.axis is not None else [0.0, 0.0, 1.0 if joint.type == FIXED else 0.0]
    return JointDescription(
        name=joint.name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        position=np.array(joint.position, dtype=float),
        rotation=rpy_deg_to_matrix(joint.rpy_deg),
        axis=np.array(axis, dtype=float),
        position_limit=(float(low), float(high)),
        velocity_limit=float(_given(limits, "rate", np.inf)),
        acceleration_limit=float(_given(limits, "acceleration", np.inf)),
        torque_limit=float(limits.torque if limits.torque is not None else np.inf),
    )


def _given(limits: LimitsModel, quantity: str, default):
    value = limits.si(quantity)
    return default if value is None else value
