"""What a capture can be made good at: a base hardly disturbed, an arm that can push, being soon; terms of an index."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np

from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.manipulability import FORCE, grasped_jacobian, manipulability
from jffsr.objectives.composite import CompositeIndex
from jffsr.objectives.smoothing import Smoothing
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.spatial.rotation import quaternion_conjugate, quaternion_multiply, quaternion_to_matrix
from jffsr.spatial.safe import safe_norm, smooth_norm
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class BaseDisturbance:
    """|Q_b dx_b|: how far the base is from its start at the end, Wang et al. 2021, eq. (26), the errata's norm.

    dx_b is the base's displacement, m, and the vector part of its relative quaternion, weighted by position, 1/m, and
    attitude.
    """

    scale: Array | float = 1.0
    position: Array | float = 1.0
    attitude: Array | float = 1.0
    name: str = field(default="base_disturbance", metadata={"static": True})

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The published form."""
        return safe_norm(self._change(motion))

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The same, rounded at zero."""
        return smooth_norm(self._change(motion), smoothing.norm * self.scale)

    def _change(self, motion: Motion) -> Vector:
        turn = quaternion_multiply(
            motion.base_quaternion[-1], quaternion_conjugate(motion.base_quaternion[0])
        )
        moved = motion.base_position[-1] - motion.base_position[0]
        return jnp.concatenate([self.position * moved, self.attitude * turn[1:]])


@register_dataclass
@dataclass(frozen=True, eq=False)
class LostManipulability:
    """The negative of a measure of manipulability at the grasp, so that less is better; may be below zero.

    measure, static, is one of `jffsr.capture.manipulability.MEASURES`; wrench (6,) is given in the grasp frame, with
    the force first; length, m, as there.
    """

    path: GraspPath
    scale: Array | float = 1.0
    wrench: Array = field(default_factory=lambda: np.array([1.0, 0, 0, 0, 0, 0]))
    length: Array | float = 1.0
    measure: str = field(default=FORCE, metadata={"static": True})
    end_effector: str | None = field(default=None, metadata={"static": True})
    name: str = field(default="lost_manipulability", metadata={"static": True})

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The measure of the last sample's posture, with a minus sign."""
        state = State(motion.base_position[-1], motion.base_quaternion[-1], motion.joint_position[-1])
        duration = motion.time[-1]
        target = self.path.target_state(duration, duration)
        jacobian = grasped_jacobian(robot, state, self.path.position_T, target.quaternion, self.end_effector)
        return -manipulability(jacobian, self.measure, self._wrench_I(duration), self.length)

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The same."""
        return self.value(robot, motion)

    def _wrench_I(self, duration: Scalar) -> Vector:
        rotation = quaternion_to_matrix(self.path.frame(duration, duration)[1])
        wrench = jnp.asarray(self.wrench)
        return jnp.concatenate([rotation @ wrench[:3], rotation @ wrench[3:]])


@register_dataclass
@dataclass(frozen=True)
class ExecutionTime:
    """How long the motion lasts, s, over `scale`; of use where the duration is free. Wang et al. 2021, eq. (16)."""

    scale: Array | float = 1.0
    name: str = field(default="execution_time", metadata={"static": True})
    unit = "s"

    def value(self, robot: Robot, motion: Motion) -> Scalar:
        """The last sample's time."""
        return jnp.asarray(motion.time[-1])

    def smooth(self, robot: Robot, motion: Motion, smoothing: Smoothing) -> Scalar:
        """The same."""
        return self.value(robot, motion)


@register_dataclass
@dataclass(frozen=True)
class IndexAtMost:
    """The constraint that an index is at most `level`, which may be below zero; in units of the index."""

    index: CompositeIndex
    level: Array | float
    tolerance: Array | float = 1e-6
    name: str = field(default="index_at_most", metadata={"static": True})

    def equality(self, robot: Robot, motion: Motion) -> Vector:
        """None."""
        return jnp.zeros(0)

    def inequality(self, robot: Robot, motion: Motion) -> Vector:
        """The published index less the level, (1,)."""
        return (self.index.value(robot, motion) - self.level)[None]
