"""What tracking gives back: the motion, the target, and how near the tool kept to it and to singularity."""

from __future__ import annotations

from dataclasses import dataclass

from jffsr.pytrees import register_dataclass
from jffsr.rollouts.motion import Motion
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class Tracked:
    """A tracked motion on K + 1 samples, K being the number of times that rates were found and held.

    motion: joint_velocity holds the rates from each sample on (at the end, up to it), joint_acceleration the change
    of rate at each sample over the time that rates are held. target_position and tool_position (K + 1, 3), m;
    target_quaternion and tool_quaternion (K + 1, 4), in I; target_twist (K + 1, 6). pose_error (K + 1, 6), in I:
    tool less target, m, and rotation vector of R_tool R_target', rad. singular_values (K + 1, min(k, n)) of the
    generalized Jacobian's k tracked directions, largest first; manipulability (K + 1,) their product; determinant
    (K + 1,) of the generalized Jacobian where it is square, else None. commanded_rate (K + 1, n), before the limits;
    limited (K + 1,), whether they changed it; share (K + 1,) of the task that was performed.
    """

    motion: Motion
    target_position: Array
    target_quaternion: Array
    target_twist: Array
    tool_position: Array
    tool_quaternion: Array
    pose_error: Array
    singular_values: Array
    manipulability: Array
    determinant: Array | None
    commanded_rate: Array
    limited: Array
    share: Array

    @property
    def time(self) -> Array:
        """Times (K + 1,), s, of the samples."""
        return self.motion.time
