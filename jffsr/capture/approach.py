"""The approach corridor: shortly before contact the tool moves along the grasp frame's first axis.

Wang et al. 2021, eq. (19), corrected: as printed the inequality is inverted, and taken at contact, where the relative
velocity is zero. Here v is the tool's velocity relative to the grasp point, in the turning frame of the target, over
the last samples before contact, and n_x' v >= |v| cos(gamma).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.tool_motion import tool_samples
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.spatial.safe import safe_norm
from jffsr.types import Array, Scalar, Vector, Vector3

HALF_ANGLE = float(np.deg2rad(30.0))


@register_dataclass
@dataclass(frozen=True, eq=False)
class ApproachCone:
    """The constraint that the relative velocity lies within half_angle, rad, of the grasp frame's x axis.

    It holds at `instants` (static) evenly over the last `share` (static) of the motion, contact left out: the samples
    nearest to these, so that a finer grid has them too. Inequalities are in units of `speed`, m/s.
    """

    path: GraspPath
    half_angle: Array | float = HALF_ANGLE
    speed: Array | float = 0.01
    tolerance: Array | float = 1e-3
    instants: int = field(default=5, metadata={"static": True})
    share: float = field(default=0.1, metadata={"static": True})
    end_effector: str | None = field(default=None, metadata={"static": True})
    name: str = field(default="approach_cone", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Vector:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Vector:
        """|v| cos(gamma) - n_x' v over `speed`, (instants,)."""
        steps = len(motion.time) - 1
        before = np.maximum(1, np.rint(steps * self.share * np.arange(self.instants, 0, -1) / self.instants))
        tool = tool_samples(robot, motion, self.end_effector, steps - before.astype(int))
        duration = motion.time[-1]

        def one(time: Scalar, position: Vector3, twist: Array) -> Scalar:
            along, length = approach_velocity(self.path, time, duration, position, twist[:3])
            return length * jnp.cos(self.half_angle) - along

        missed = jax.vmap(one)(tool.time, tool.position, tool.twist)
        return missed / self.speed


def approach_velocity(
    path: GraspPath, time: Scalar, duration: Scalar, position: Vector3, velocity: Vector3
) -> tuple[Scalar, Scalar]:
    """Component along the grasp frame's x axis, and length, m/s, of a tool's velocity relative to the target.

    position, m, and velocity, m/s, (3,) in I.
    """
    origin, quaternion, twist = path.frame(time, duration)
    carried = twist[:3] + jnp.cross(twist[3:], position - origin)
    relative = velocity - carried
    axis = quaternion_to_matrix(quaternion)[:, 0]
    return axis @ relative, safe_norm(relative)
