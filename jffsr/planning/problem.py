"""A planning problem: a robot, a trajectory with free numbers, an index, and where the motion begins."""

from __future__ import annotations

from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np

from jffsr.dynamics.base_mode import FLOATING
from jffsr.objectives.composite import CompositeIndex, TermValue
from jffsr.objectives.constraints import Constraint, tolerance_of
from jffsr.optimizers.constraints import Evaluation
from jffsr.planning.uncertainty import Uncertainty
from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.rollouts.joint_torque import with_joint_torque
from jffsr.rollouts.kernels import FAST
from jffsr.rollouts.motion import Motion
from jffsr.rollouts.rollout import rollout
from jffsr.trajectories.interface import PlannedTrajectory
from jffsr.types import Array, Scalar, Vector

SEARCH_SHARE = 0.1
"""What the search may use of an equality's tolerance; the rest is for the difference of the finer grid."""


def _at_rest_at_origin() -> State:
    return State(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(0))


@register_dataclass
@dataclass(frozen=True, eq=False)
class Problem:
    """Choose the free numbers of `trajectory` so that the index of the motion is least under the constraints.

    initial_state gives the base pose at the start (the joints are the trajectory's); momentum (6,) is P, then
    L about the system centre of mass, in I; num_steps, static, is the number of Runge-Kutta steps; base_mode
    and kernel, static, are those of `jffsr.rollout`. With an uncertainty the index is measured over its robots; motion
    and terms remain those of `robot`. Constraints, none by default, must have different names. All else is traced:
    problems of one robot with other numbers share their compiled programs.
    """

    robot: Robot
    trajectory: PlannedTrajectory
    objective: CompositeIndex
    initial_state: State = field(default_factory=_at_rest_at_origin)
    momentum: Array = field(default_factory=lambda: np.zeros(6))
    num_steps: int = field(default=100, metadata={"static": True})
    base_mode: str = field(default=FLOATING, metadata={"static": True})
    kernel: str = field(default=FAST, metadata={"static": True})
    uncertainty: Uncertainty | None = None
    constraints: tuple[Constraint, ...] = ()

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds (k,) of the free numbers."""
        return self.trajectory.free_bounds()

    def motion(self, candidate: Vector, robot: Robot | None = None) -> Motion:
        """The motion under the free numbers (k,), of another robot where one is given."""
        robot = self.robot if robot is None else robot
        trajectory = self.trajectory.with_free(candidate)
        motion = rollout(
            robot,
            trajectory,
            self.initial_state,
            num_steps=self.num_steps,
            momentum=self.momentum,
            base_mode=self.base_mode,
            kernel=self.kernel,
        )
        if not self.needs_torque:
            return motion
        return with_joint_torque(robot, motion, self.kernel)

    @property
    def needs_torque(self) -> bool:
        """Whether the index or a constraint reads the joint torques, which motions then carry."""
        constrained = any(getattr(constraint, "needs_torque", False) for constraint in self.constraints)
        return constrained or self.objective.needs_torque

    def value(self, candidate: Vector) -> Scalar:
        """The published index, or its measure over the uncertain robots."""
        if self.uncertainty is None:
            return self._value(self.robot, candidate)
        return self.uncertainty.measured(lambda robot: self._value(robot, candidate))

    def _value(self, robot: Robot, candidate: Vector) -> Scalar:
        return self.objective.value(robot, self.motion(candidate, robot))

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The smooth index and the published one, of the same motions."""

        def both(robot: Robot) -> tuple[Scalar, Scalar]:
            motion = self.motion(candidate, robot)
            return self.objective.smooth(robot, motion, looseness), self.objective.value(robot, motion)

        return (
            both(self.robot)
            if self.uncertainty is None
            else self.uncertainty.measured_smooth(both, looseness)
        )

    def evaluation(self, candidate: Vector, looseness: Scalar | float = 1.0) -> Evaluation:
        """The smooth index, the published one, and all constraints in their order, of the same motion.

        With an uncertainty the indices are measured over its robots; the constraints are those of the robot itself.
        """
        motion = self.motion(candidate)
        if self.uncertainty is None:
            smooth = self.objective.smooth(self.robot, motion, looseness)
            value = self.objective.value(self.robot, motion)
        else:
            smooth, value = self.smooth_and_value(candidate, looseness)
        equalities = [c.equality(self.robot, motion) for c in self.constraints]
        allowed = [
            jnp.broadcast_to(SEARCH_SHARE * jnp.asarray(tolerance_of(c)), found.shape)
            for c, found in zip(self.constraints, equalities, strict=True)
        ]
        none = [jnp.zeros(0)]
        return Evaluation(
            smooth=smooth,
            value=value,
            equality=jnp.concatenate(none + equalities),
            inequality=jnp.concatenate(none + [c.inequality(self.robot, motion) for c in self.constraints]),
            tolerance=jnp.concatenate(none + allowed),
        )

    def terms(self, candidate: Vector) -> dict[str, TermValue]:
        """Every term of the published index by name, before and after weighting."""
        return self.objective.breakdown(self.robot, self.motion(candidate))
