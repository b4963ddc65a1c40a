"""What the configurations of all kinds of study share: where a key was written, and limits joint by joint."""

from __future__ import annotations

from pydantic import PrivateAttr

from jffsr.errors import InputError
from jffsr.reading.section import Section
from jffsr.reading.sources import Sources

NAME = r"(?!\.+\Z)[A-Za-z0-9_.-]{1,100}"  # also the name of a folder, so not . or ..


class RobotStudy(Section):
    """A study of one robot whose section `limits` may replace the robot's own."""

    _sources: Sources = PrivateAttr(default_factory=Sources)

    def where(self, key: str) -> str:
        """Place and key for a message: `configs/x.yaml:12: task.goal_deg`; of a default, its section's."""
        return self._sources.where(key)

    def per_joint(self, quantity: str, num_joints: int) -> tuple | None:
        """The limit `position` ((low, high) each), `rate`, `acceleration` or `torque` of each joint; rad or m, s, N.

        None when not given. Raises InputError when a list is given whose length is not the number of joints.
        """
        value = getattr(self.limits, f"{quantity}_si")
        if value is None:
            return None
        if not isinstance(getattr(self.limits, self.limits.key_of(quantity)), tuple):
            return (value,) * num_joints
        if len(value) != num_joints:
            where = self.where(f"limits.{self.limits.key_of(quantity)}")
            raise InputError(f"{where}: found a list of {len(value)}, the robot has {num_joints} joints")
        return value
