"""The section `task` of studies that give no goal for the joints: where the robot starts, and with what momentum."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from jffsr.dynamics.base_mode import ATTITUDE_HELD, BASE_MODES, FIXED, FLOATING
from jffsr.reading.section import Section
from jffsr.reading.values import choice, conflict, text
from jffsr.study.schema_task import Joints, Quaternion, Vector3


class Start(Section):
    """Where the robot starts, and with what momentum."""

    units: ClassVar = ("start",)

    start_deg: Joints | None = None
    start: Joints | None = None
    linear_momentum: Vector3 = (0.0, 0.0, 0.0)  # N s
    angular_momentum: Vector3 = (0.0, 0.0, 0.0)  # N m s, about the system centre of mass
    base_position: Vector3 = (0.0, 0.0, 0.0)  # m
    base_quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)  # w, x, y, z
    base_mode: Annotated[Literal["floating", "attitude_held", "fixed"], choice(*BASE_MODES)] = FLOATING
    end_effector: Annotated[str, text(r".{1,200}", "the name of an end effector or null")] | None = None

    @model_validator(mode="after")
    def _check(self) -> Start:
        self.check_units("start")
        lost = {ATTITUDE_HELD: ("angular",), FIXED: ("linear", "angular")}.get(self.base_mode, ())
        for key in (f"{kind}_momentum" for kind in lost):
            if any(getattr(self, key)):
                found = list(getattr(self, key))
                raise conflict(
                    f"found {found}, base_mode '{self.base_mode}' does not keep it, leave it out", key
                )
        return self

    @property
    def momentum(self) -> tuple[float, ...]:
        """(6,): linear (N s), then angular about the system centre of mass (N m s), in the inertial frame."""
        return self.linear_momentum + self.angular_momentum
