"""Pose and twist of a tool at samples of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.kinematics import end_effector_pose, jacobians, kinematics
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.types import Array


@register_dataclass
@dataclass(frozen=True)
class ToolSamples:
    """time (k,), s; position (k, 3), m; quaternion (k, 4), E to I; twist (k, 6), [linear; angular], in I."""

    time: Array
    position: Array
    quaternion: Array
    twist: Array

    def __getitem__(self, index) -> ToolSamples:
        return jax.tree.map(lambda x: x[index], self)


def tool_samples(
    robot: Robot, motion: Motion, end_effector: str | None = None, samples: np.ndarray | None = None
) -> ToolSamples:
    """The tool at these samples (k,) of a motion, by their numbers (static); None means all."""
    chosen = np.arange(len(motion.time)) if samples is None else np.asarray(samples)

    def one(position: Array, quaternion: Array, twist: Array, q: Array, qd: Array):
        kin = kinematics(robot, State(position, quaternion, q))
        j_b, j_m = jacobians(robot, kin, end_effector)
        return *end_effector_pose(robot, kin, end_effector), j_b @ twist + j_m @ qd

    fields = (
        motion.base_position,
        motion.base_quaternion,
        motion.base_twist,
        motion.joint_position,
        motion.joint_velocity,
    )
    position, quaternion, twist = jax.vmap(one)(*(jnp.asarray(x)[chosen] for x in fields))
    return ToolSamples(jnp.asarray(motion.time)[chosen], position, quaternion, twist)
