"""What is measured: robots, batches, steps, and the numbers that every opponent gets.

One reference point, and one thing varied at a time around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import jffsr

DURATION = 30.0
ROBOTS = {
    "two joints": "hu_2011_planar2",
    "six joints": "wu_2018_6dof",
    "seven joints": "servicer_7dof",
    "fourteen joints": "dual_arm_servicer",
}
BATCHES = (1, 64, 1024, 16384)
STEPS = (50, 200, 500, 2000)
ONE_EVALUATION = 16384
"""Base twists in a batch of single evaluations."""

FLOAT64, FLOAT32 = "float64", "float32"


def tolerance(precision: str, steps: int) -> float:
    """Largest difference of a component of the final quaternion that counts as the same motion.

    All opponents take the same Runge-Kutta steps, but some see the attitude of a stage as it is and others at unit
    length, which differs by the error of the method: in float64 1e-7 at 200 steps, of order 4.
    """
    return 2e-3 if precision == FLOAT32 else 1e-7 * max(1.0, (200 / steps) ** 4)


@dataclass(frozen=True)
class Case:
    """A batch of rollouts of one robot; `precision` is that of the process that runs it."""

    robot_name: str = ROBOTS["seven joints"]
    batch: int = 1024
    steps: int = 200
    precision: str = FLOAT64

    @cached_property
    def robot(self) -> jffsr.Robot:
        """The robot, its numbers in the precision of the case."""
        import jax

        robot = jffsr.load_robot(self.robot_name)
        return jax.tree.map(lambda x: np.asarray(x, self.dtype), robot)

    @property
    def dtype(self) -> np.dtype:
        """The floating-point type."""
        return np.dtype(self.precision)

    @property
    def step(self) -> float:
        """Length of a step, s."""
        return DURATION / self.steps

    @cached_property
    def trajectory(self) -> jffsr.SinePolynomial:
        """A rest-to-rest motion of all joints inside +-170 degrees."""
        import jax

        joints = np.arange(self.robot.num_joints)
        limit = np.full(joints.size, np.deg2rad(170.0))
        start, goal = 0.9 * np.sin(1.0 + 1.7 * joints), 0.9 * np.sin(2.5 + 2.3 * joints)
        trajectory = jffsr.SinePolynomial.between(start, goal, -limit, limit, DURATION)
        return jax.tree.map(lambda x: np.asarray(x, self.dtype), trajectory)

    @cached_property
    def free(self) -> np.ndarray:
        """The free numbers (batch, 2n) of the candidates: the alphas, then the betas."""
        draw = np.random.default_rng(0).uniform(-1.0, 1.0, (self.batch, 2 * self.robot.num_joints))
        return draw.astype(self.dtype)

    @cached_property
    def postures(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Joint positions and rates (batch, n) and unit quaternions (batch, 4) for single evaluations."""
        draw, n = np.random.default_rng(1), self.robot.num_joints
        quaternion = draw.normal(size=(self.batch, 4))
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        position, rate = draw.uniform(-2.5, 2.5, (self.batch, n)), draw.uniform(-0.3, 0.3, (self.batch, n))
        return tuple(x.astype(self.dtype) for x in (position, rate, quaternion))

    def varied(self, **changes) -> Case:
        """The case with something else in its place."""
        return replace(self, **changes)


def initial_state() -> jffsr.State:
    """The base at the origin, its axes those of I."""
    return jffsr.State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(0))
