"""The published arm with its load, a smooth joint motion to follow, and a controller that tells what it was given."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

import jffsr
from jffsr.reactionless.control.recorded import Recorded

PERIOD = 0.01
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
ROBOT = jffsr.load_robot("ye_2019_planar3")
POSTURE = np.array([0.3, -0.5, 0.4])
START = jffsr.State(np.zeros(3), UPRIGHT, POSTURE, np.zeros(6), np.zeros(3))


def loaded(mass: float = 5.0, inertia: float = 2.5, distance: float = 0.1) -> jffsr.Robot:
    """The arm with a load, its centre of mass beyond the tip, in the paper's plane."""
    body = jffsr.RigidBody(mass, np.zeros(3), inertia * np.eye(3))
    return jffsr.weld(ROBOT, body, position=(distance, 0.0, 0.0))


def waves(samples: int, amplitude: float = 0.1, posture: np.ndarray = POSTURE) -> Recorded:
    """Joints that swing about a posture from rest: a (1 - cos(t)) each, in different directions."""
    scale = amplitude * np.array([1.0, -1.0, 0.5])

    def motion(t):
        return posture + scale * (1 - jnp.cos(t)), scale * jnp.sin(t), scale * jnp.cos(t)

    return Recorded.of(motion, samples, PERIOD)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Echo:
    """A controller whose torque is what it measured, times a factor: joint positions, then rates, or the base's."""

    factor: float
    what: int

    def begin(self, measured):
        return ()

    def advance(self, state, time, measured, desired):
        seen = (measured.joint_position, measured.joint_velocity, measured.base_rate)
        return state, self.factor * jax.lax.switch(self.what, [lambda i=i: seen[i] for i in range(3)])
