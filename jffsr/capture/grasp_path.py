"""Where a grasp frame is at each time of a robot's motion."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.target.grasp_frames import fixed_frame
from jffsr.target.target_state import TargetState
from jffsr.target.tumbling import TargetMotion
from jffsr.types import Array, Quaternion, Scalar, Twist, Vector3


@register_dataclass
@dataclass(frozen=True, eq=False)
class GraspPath:
    """A frame (position_T (3,), m, and quaternion_T (4,), G to T) on a moving target, by the robot's own time.

    begin (), s: the time of the target's motion at which the robot's begins. Where `grasp_time` (), s, of the target's
    motion is given, the robot's motion ends then whatever its duration, and `begin` follows from that.
    """

    motion: TargetMotion
    position_T: Vector3
    quaternion_T: Quaternion
    begin: Array | float = 0.0
    grasp_time: Array | None = field(default=None)

    @classmethod
    def create(
        cls,
        motion: TargetMotion,
        grasp: str | None = None,
        begin: Array | float = 0.0,
        grasp_time: Array | float | None = None,
    ) -> GraspPath:
        """That of a grasp frame by its name, the first for None; InputError for a name that is none."""
        index = motion.target.grasp_index(grasp)
        target = motion.target
        return cls(motion, target.grasp_position[index], target.grasp_quaternion[index], begin, grasp_time)

    def target_state(self, time: Scalar, duration: Scalar) -> TargetState:
        """The target at `time`, s, of a robot's motion that lasts `duration`, s."""
        begin = self.begin if self.grasp_time is None else self.grasp_time - duration
        return self.motion(begin + time)

    def frame(self, time: Scalar, duration: Scalar) -> tuple[Vector3, Quaternion, Twist]:
        """Origin (3,), m, quaternion (4,), G to I, and twist (6,), [linear; angular], in I, at `time`."""
        state = self.target_state(time, duration)
        return fixed_frame(state, jnp.asarray(self.position_T), jnp.asarray(self.quaternion_T))
