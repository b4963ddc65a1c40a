"""What the configurations of all kinds of study share: where a key was written, and limits joint by joint."""

from __future__ import annotations

from collections.abc import Sequence

from pydantic import PrivateAttr

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.reading.section import Section
from jffsr.reading.sources import Sources

NAME = r"(?!\.+\Z)[A-Za-z0-9_.-]{1,100}"  # also the name of a folder, so not . or ..


class RobotStudy(Section):
    """A study of one robot whose section `limits` may replace the robot's own."""

    _sources: Sources = PrivateAttr(default_factory=Sources)

    def where(self, key: str) -> str:
        """Place and key for a message: `configs/x.yaml:12: task.goal_deg`; of a default, its section's."""
        return self._sources.where(key)

    def per_joint(self, quantity: str, names: Sequence[str], own: Sequence) -> tuple | None:
        """The limit `position` ((low, high) each), `rate`, `acceleration` or `torque` of each joint; rad or m, s, N.

        names and own are the joints' names and the limits that the robot itself has. None when not given. Raises
        InputError when a list is given whose length is not the number of joints, or a name that no joint has.
        """
        value, key = getattr(self.limits, f"{quantity}_si"), f"limits.{self.limits.key_of(quantity)}"
        if value is None:
            return None
        if isinstance(value, dict):
            for name in value:
                if name not in names:
                    advice = hint(name, names) or f"; the joints are {', '.join(names)}"
                    raise InputError(f"{self.where(f'{key}.{name}')}: the robot has no such joint{advice}")
            return tuple(value.get(name, limit) for name, limit in zip(names, own, strict=True))
        if not isinstance(getattr(self.limits, self.limits.key_of(quantity)), tuple):
            return (value,) * len(names)
        if len(value) != len(names):
            where = self.where(key)
            raise InputError(f"{where}: found a list of {len(value)}, the robot has {len(names)} joints")
        return value
