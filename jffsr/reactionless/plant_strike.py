"""A pendulum that strikes the tool: Ye, Dong and Hong 2019, equations (50) and (51)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jffsr.reactionless.plant_settings import Strike


@dataclass(frozen=True)
class Pendulum:
    """A block on a rope: mass, kg; rope, m; released at rest at `release` and back up to `rebound`, rad; the stroke
    lasts `contact`, s, at an angle `incidence`, rad, to the yaw axis' normal; arm, m, from the tool; gravity, m/s^2.

    The defaults are the paper's, its arm the 0.1 m of its Table 1. It prints F of about 10 N and 0.5 N m, which its own
    formulas do not give: 75.6 N and 3.78 N m.
    """

    mass: float = 5.0
    rope: float = 0.2
    release: float = float(np.deg2rad(10.0))
    rebound: float = float(np.deg2rad(3.8))
    contact: float = 0.01
    incidence: float = float(np.deg2rad(30.0))
    arm: float = 0.1
    gravity: float = 9.8

    @property
    def force(self) -> float:
        """Mean force, N, over the contact, m (v_0 - v_t)/t."""
        speeds = np.sqrt(2 * self.gravity * self.rope * (1 - np.cos(np.array([self.release, self.rebound]))))
        return float(self.mass * (speeds[0] - speeds[1]) / self.contact)

    @property
    def moment(self) -> float:
        """Mean moment, N m, about the yaw axis, F sin(incidence) arm."""
        return float(self.force * np.sin(self.incidence) * self.arm)

    def strike(self, time: float, with_force: bool = False) -> Strike:
        """The stroke at `time`, s: the moment alone about the tool's z axis, as the paper has it.

        with_force: the yaw share of the force as well, along the tool's y axis, as a block that hits the tool would; it
        then gives the whole system momentum.
        """
        across = self.force * float(np.sin(self.incidence)) if with_force else 0.0
        return Strike(np.array([0.0, across, 0.0, 0.0, 0.0, self.moment]), time, self.contact)
