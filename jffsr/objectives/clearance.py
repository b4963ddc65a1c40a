"""The constraint that bodies keep clear of each other over a motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp

from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.safe import smooth_max
from jffsr.types import Array

MISS = 0.1
"""Clearance, m, whose lack counts as 1."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True, eq=False)
class Clearance:
    """Every pair of bodies of `model` stays `margin`, m, apart at all samples of the motion.

    A model with a target needs `target`: a pytree that is called with a time, s, and gives what has position (3,), m,
    and quaternion (4,), T to I, such as a TargetMotion; the motion's time zero is its time `begin`. Or states at the
    motion's own samples, (N + 1, ...) each. The smallest distance over time is rounded off downwards over `width`, m,
    so that the margin is kept a little early, by width log(N + 1) at most. Overruns count per 0.1 m, so that the
    tolerance is 0.1 mm.
    """

    model: ClearanceModel
    margin: Array | float = 0.02
    target: Callable[[Array], Any] | Any | None = None
    begin: Array | float = 0.0
    width: Array | float = 1e-3
    tolerance: Array | float = 1e-3
    name: str = field(default="clearance", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """How far each pair comes within the margin, (p,), per 0.1 m."""
        states = self.target
        if callable(states):
            states = jax.vmap(states)(motion.time + self.begin)
        distances = clearances(self.model, robot, motion, states)
        return (jnp.asarray(self.margin) + smooth_max(-jnp.asarray(distances), self.width, axis=1)) / MISS
