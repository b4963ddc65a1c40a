"""What every section of a configuration shares: closed, frozen, and at most one unit for each quantity."""

from __future__ import annotations

import math
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, model_serializer

from jffsr.reading.values import conflict


class Section(BaseModel):
    """A frozen group of keys; an unknown key is an error.

    `units` names the quantities that may be given as `x` (rad or m) or as `x_deg` (degrees), never both; null
    counts as not given, so that a file can take back what another file gave.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    units: ClassVar[tuple[str, ...]] = ()

    def key_of(self, quantity: str) -> str:
        """The key under which the quantity was given: `x_deg` or, also when it was not given, `x`."""
        return f"{quantity}_deg" if getattr(self, f"{quantity}_deg", None) is not None else quantity

    def si(self, quantity: str) -> Any:
        """The quantity's value, degrees turned into radians at every depth; None when not given."""
        plain, degrees = getattr(self, quantity), getattr(self, f"{quantity}_deg")
        return plain if degrees is None else _radians(degrees)

    def check_units(self, *required: str) -> None:
        """Raise the error of a quantity that is given twice, or of a required one that is not given."""
        for quantity in self.units:
            plain, degrees = quantity, f"{quantity}_deg"
            given = [key for key in (degrees, plain) if getattr(self, key) is not None]
            if len(given) == 2:
                sentence = f"both '{degrees}' and '{plain}' are given, keep one (or set the other to null)"
                raise conflict(sentence, plain)
            if not given and quantity in required:
                raise conflict(f"missing, '{degrees}' (or '{plain}', in rad or m) is required", degrees)

    @model_serializer(mode="wrap")
    def _without_unused_units(self, handler) -> dict[str, Any]:
        unused = {f"{quantity}{suffix}" for quantity in self.units for suffix in ("", "_deg")}
        return {key: value for key, value in handler(self).items() if value is not None or key not in unused}


def _radians(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _radians(v) for key, v in value.items()}
    return tuple(_radians(v) for v in value) if isinstance(value, tuple) else math.radians(value)
