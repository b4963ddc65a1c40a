"""Clearance between a robot, itself and the target it is about to grasp."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp

from jffsr.capture.grasp_path import GraspPath
from jffsr.objectives.clearance import Clearance
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True, eq=False)
class TargetClearance:
    """The constraint `keep` with the target where the path has it, also where the motion's duration is free."""

    path: GraspPath
    keep: Clearance
    name: str = field(default="clearance", metadata={"static": True})

    @property
    def tolerance(self) -> Array | float:
        """That of `keep`."""
        return self.keep.tolerance

    def equality(self, robot: Robot, motion: Motion) -> Array:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Array:
        """How far each pair comes within the margin, (p,), per 0.1 m."""
        duration = motion.time[-1]
        states = jax.vmap(lambda time: self.path.target_state(time, duration))(motion.time)
        return replace(self.keep, target=states).inequality(robot, motion)
