"""The YAML form of a solid, of a robot's link or of a target; nothing heavy is imported here."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import PlainValidator

from jffsr.reading.section import Section
from jffsr.reading.values import choice, expected, sequence


def _any_float() -> PlainValidator:
    """A number; one that is not finite passes, because the builder can name the body that it belongs to."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise expected("a number")
        try:
            return float(value)
        except OverflowError:
            return float("inf")

    return PlainValidator(check)


Number = Annotated[float, _any_float()]
Triple = Annotated[tuple[Number, ...], sequence("a list of 3 numbers", 3, 3)]
Solid = Literal["box", "sphere", "cylinder", "capsule", "ellipsoid"]
ORIGIN = (0.0, 0.0, 0.0)


class ShapeModel(Section):
    """A solid on a link, for drawing and clearance; `size` as in `jffsr.robots.geometry.Shape`, in m."""

    type: Annotated[Solid, choice(*get_args(Solid))]
    size: Annotated[tuple[Number, ...], sequence("a list of 1 to 3 numbers", 1, 3)]
    position: Triple = ORIGIN
    rpy_deg: Triple = ORIGIN
    role: Annotated[Literal["both", "visual", "collision"], choice("both", "visual", "collision")] = "both"
    colour: (
        Annotated[tuple[Number, ...], sequence("a list of 4 numbers (red, green, blue, alpha)", 4, 4)] | None
    ) = None
