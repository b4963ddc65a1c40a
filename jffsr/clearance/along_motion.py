"""Signed distances over a whole motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from jffsr.clearance.numerics import arrays_for, computed_once, module_for
from jffsr.clearance.poses import body_poses
from jffsr.robots.robot import Robot
from jffsr.spatial.components import quaternion_rows
from jffsr.types import Array

if TYPE_CHECKING:
    from jffsr.clearance.model import ClearanceModel


def clearances(model: ClearanceModel, robot: Robot, motion: Any, target_states: Any | None = None) -> Array:
    """Signed distances (p, N + 1), m, of all pairs at the samples of a motion; time is the last axis.

    motion is a Motion of the robot, or whatever has base_position (N + 1, 3), base_quaternion (N + 1, 4) and
    joint_position (N + 1, n); target_states has position (N + 1, 3), m, and quaternion (N + 1, 4), T to I, at the same
    times, as a TargetState has. Under `jit` it is traced, else NumPy does it.
    """
    model.check_target(target_states is not None)
    poses = (motion.base_position, motion.base_quaternion, motion.joint_position)
    target = () if target_states is None else (target_states.position, target_states.quaternion)
    xp = module_for(model, robot, poses, target)
    origins, rotations = body_poses(xp, robot, *arrays_for(xp, poses))
    if target:
        position, quaternion = arrays_for(xp, target)
        origins.append(tuple(position[:, i] for i in range(3)))
        rotations.append(quaternion_rows(tuple(quaternion[:, i] for i in range(4))))
    origins, rotations = computed_once(xp, (origins, rotations))
    position = tuple(xp.stack([origin[i] for origin in origins]) for i in range(3))
    rotation = tuple(tuple(xp.stack([r[i][k] for r in rotations]) for k in range(3)) for i in range(3))
    return model.of_components(xp, *computed_once(xp, (position, rotation)))
