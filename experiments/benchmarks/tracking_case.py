"""What the tracking benchmark measures: Wu's arm, a thousand trackers, states for single steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

import jffsr

ROBOT = "wu_2018_6dof"
START = np.deg2rad([175.0, -60.0, -60.0, 0.0, 210.0, 5.0])
DURATION, PERIOD, INNER = 25.0, 0.25, 4
LARGEST, EPSILON = 0.0571, 0.0677
TOLERANCE = 1e-8
"""Largest difference of a component between programs that do the same: joints, rad, poses, singular values, J*."""


@dataclass(frozen=True)
class TrackingCase:
    """So many trackers, and so many states."""

    trackers: int = 1000
    states: int = 1024

    @cached_property
    def robot(self) -> jffsr.Robot:
        """Six axes on a base of 450 kg."""
        return jffsr.load_robot(ROBOT)

    @cached_property
    def numbers(self) -> dict[str, np.ndarray]:
        """lambda_max and epsilon (K,), gains (K,), 1/s, and the targets' goals (K, 3), m, each drawn anew."""
        draw, count = np.random.default_rng(0), self.trackers
        return {
            "lambda_max": draw.uniform(0.04, 0.08, count),
            "epsilon": draw.uniform(0.05, 0.09, count),
            "gain": draw.uniform(0.0, 1.0, count),
            "goal": np.array([1.5, 0.0, -0.2]) + draw.uniform(-0.05, 0.05, (count, 3)),
        }

    @cached_property
    def postures(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Joints (K, n), base quaternions (K, 4) and tool twists (K, 6), m/s and rad/s."""
        draw, n = np.random.default_rng(1), self.robot.num_joints
        quaternion = draw.normal(size=(self.states, 4))
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        position = draw.uniform(-2.5, 2.5, (self.states, n))
        return position, quaternion, draw.uniform(-0.05, 0.05, (self.states, 6))
