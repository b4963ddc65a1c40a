"""A motion of joint rates held from sample to sample, for code that takes a trajectory, and its independent re-run."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp

from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.reference import reference_rollout
from jffsr.types import Array, Scalar, Vector


@register_dataclass
@dataclass(frozen=True)
class HeldRates:
    """Joints that go straight from one sample to the next: a trajectory, (q, qd, 0) at a time.

    joint_position (K + 1, n), rad or m; duration, s. At a sample the rate is that after it, at the end that before.
    """

    joint_position: Array
    duration: Array

    @classmethod
    def of(cls, motion: Motion) -> HeldRates:
        """The joints of a tracked motion."""
        return cls(motion.joint_position, motion.time[-1])

    def __call__(self, time: Scalar) -> tuple[Vector, Vector, Vector]:
        """Position, rate and acceleration, (n,) each."""
        intervals = self.joint_position.shape[0] - 1
        step = self.duration / intervals
        k = jnp.clip(jnp.floor(time / step).astype(int), 0, intervals - 1)
        before, after = self.joint_position[k], self.joint_position[k + 1]
        rate = (after - before) / step
        return before + (time - k * step) * rate, rate, jnp.zeros_like(rate)


def rerun(robot: Robot, motion: Motion, num_steps: int) -> Motion:
    """The same joint motion by `reference_rollout`, in num_steps (static) steps from each sample to the next.

    Motions of single intervals, (K, num_steps + 1, ...): rates jump between them, and no step may lie across a jump.
    """
    step = motion.time[1] - motion.time[0]

    def interval(pose: tuple[Array, Array], joints: Array) -> tuple[tuple[Array, Array], Motion]:
        found = reference_rollout(
            robot,
            HeldRates(joints, step),
            State(*pose, joints[0]),
            num_steps=num_steps,
            momentum=motion.momentum,
            base_mode=motion.base_mode,
        )
        return (found.base_position[-1], found.base_quaternion[-1]), found

    ends = jnp.stack([motion.joint_position[:-1], motion.joint_position[1:]], axis=1)
    _, found = jax.lax.scan(interval, (motion.base_position[0], motion.base_quaternion[0]), ends)
    return found
