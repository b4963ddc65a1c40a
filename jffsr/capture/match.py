"""The tool meets the grasp frame: same pose and twist at the motion's end; Wang et al. 2021, eqs. (24), (25)."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.tool_motion import tool_samples
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
)
from jffsr.types import Array, Vector


@register_dataclass
@dataclass(frozen=True, eq=False)
class GraspMatch:
    """The constraint that the tool has the grasp frame's pose and twist when the motion ends.

    Its twelve equalities are errors in SI units: position, m, rotation vector of R_G' R_E, rad, linear velocity, m/s,
    and angular velocity, rad/s, of the tool less the grasp frame's, velocities in I. A Constraint of a Problem.
    """

    path: GraspPath
    tolerance: Array | float = 1e-6
    end_effector: str | None = field(default=None, metadata={"static": True})
    name: str = field(default="grasp_match", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Vector:
        """The errors (12,)."""
        return grasp_error(robot, motion, self.path, self.end_effector)

    def inequality(self, robot: Robot, motion: Motion) -> Vector:
        """None."""
        return jnp.zeros(0)


def grasp_error(robot: Robot, motion: Motion, path: GraspPath, end_effector: str | None = None) -> Vector:
    """Errors (12,) of the tool at a motion's end: position, m, rotation vector, rad, velocity, m/s and rad/s."""
    tool = tool_samples(robot, motion, end_effector, [len(motion.time) - 1])[0]
    position, quaternion, twist = path.frame(tool.time, tool.time)
    turn = quaternion_multiply(quaternion_conjugate(quaternion), tool.quaternion)
    return jnp.concatenate(
        [tool.position - position, quaternion_to_rotation_vector(turn), tool.twist - twist]
    )
