"""How a finished plan answers to errors in the masses and inertias that it was made with.

One forward-mode Jacobian of the plan's motion, run again as the planner ran it: the joints follow the same law,
and a wrong mass or inertia shows in where the base and the tool end. The published index has corners where its
norms are zero, which is where an optimizer ends; so the derivative of the index is that of its smooth form.
"""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.dynamics.kinematics import end_effector_pose, kinematics
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.robots.state import State
from jffsr.spatial.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    quaternion_to_rotation_vector,
)
from jffsr.types import Array, Scalar, Vector, Vector3

MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Order of the six elements of an inertia."""
_ROWS, _COLUMNS = np.array([0, 1, 2, 0, 0, 1]), np.array([0, 1, 2, 1, 2, 2])
# Where each of the nine elements of the matrix stands among the six.
_PLACE = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])


@register_dataclass
@dataclass(frozen=True)
class Inertials:
    """Something for each body's mass (..., b) and for each of the six elements of its inertia (..., b, 6)."""

    mass: Any
    inertia: Any


@register_dataclass
@dataclass(frozen=True)
class PlanEnd:
    """What a plan leads to, or derivatives of it.

    index, the smooth index; attitude (3,), rad, rotation vector of the final base attitude relative to the
    plan's own, in B at the end; position (3,), m, of the base's centre of mass, and tool (3,), m, of the first
    end effector, both in I at the end; tool is None where there is no end effector.
    """

    index: Scalar
    attitude: Vector3
    position: Vector3
    tool: Vector3 | None


@dataclass(frozen=True)
class PerPercent:
    """What one percent of one body's mass, or of its whole inertia, does to a plan.

    body; quantity is "mass" or "inertia"; index, change of the smooth index; attitude, rad, position, m, and
    tool, m, are lengths of the change of final attitude, base position and tool position; tool is None where
    there is no end effector.
    """

    body: str
    quantity: str
    index: float
    attitude: float
    position: float
    tool: float | None

    @property
    def sentence(self) -> str:
        """The effect in words."""
        tool = "" if self.tool is None else f"the final tool by {1e3 * self.tool:.2g} mm and "
        return (
            f"1 % of the {self.quantity} of {self.body} moves {tool}the final attitude by "
            f"{np.rad2deg(self.attitude):.2g} deg"
        )


@dataclass(frozen=True)
class Sensitivity:
    """First derivatives of a finished plan by every mass and inertia (host arrays).

    bodies, names (b,); nominal, the masses (b,), kg, and inertias (b, 6), kg m^2, in the order xx, yy, zz, xy,
    xz, yz; derivative: for each entry of PlanEnd the derivatives by these, in front of their axes those of the
    entry, so that derivative.attitude.inertia is (3, b, 6), rad/(kg m^2). The derivative by an element off the
    diagonal moves its mirror image along.
    """

    bodies: tuple[str, ...]
    end_effector: str | None
    nominal: Inertials
    derivative: PlanEnd

    @property
    def per_percent(self) -> tuple[PerPercent, ...]:
        """Every mass and inertia by what one percent of it does, the largest first.

        Largest is by the way of the tool, or by the turn of the base where there is no end effector.
        """
        rows = []
        for quantity in ("mass", "inertia"):
            shares = 0.01 * getattr(self.nominal, quantity)
            sums = "...b,b->b..." if quantity == "mass" else "...bk,bk->b..."
            effects = {
                name: np.einsum(sums, getattr(entry, quantity), shares)
                for name, entry in vars(self.derivative).items()
                if entry is not None
            }
            for k, body in enumerate(self.bodies):
                lengths = {
                    name: float(np.linalg.norm(effect[k]))
                    for name, effect in effects.items()
                    if name != "index"
                }
                rows.append(
                    PerPercent(body, quantity, float(effects["index"][k]), **({"tool": None} | lengths))
                )
        return tuple(sorted(rows, key=_size, reverse=True))


def _size(row: PerPercent) -> float:
    size = row.attitude if row.tool is None else row.tool
    return size if np.isfinite(size) else -np.inf


def sensitivity(problem: Problem, free: Vector) -> Sensitivity:
    """Derivatives of the plan with the free numbers (k,) by the robot's masses and inertias.

    One compiled Jacobian, which problems of the same structure share.
    """
    robot = problem.robot
    nominal, derivative = jax.device_get(_jacobian(problem, free))
    names = robot.end_effector_names
    return Sensitivity(robot.body_names, names[0] if names else None, nominal, derivative)


def prepare_sensitivity(problem: Problem, free: Vector | jax.ShapeDtypeStruct) -> Future | None:
    """Begin to compile, in a thread, what `sensitivity` with arguments of these shapes will call."""
    return _jacobian.prepare(problem, free)


@program(once=True)
def _jacobian(problem: Problem, free: Vector) -> tuple[Inertials, PlanEnd]:
    robot = problem.robot
    inertia = jnp.asarray(robot.inertia)
    nominal = Inertials(jnp.asarray(robot.mass), inertia[:, _ROWS, _COLUMNS])
    return nominal, jax.jacfwd(lambda inertials: _plan_end(problem, free, inertials))(nominal)


def _plan_end(problem: Problem, free: Vector, inertials: Inertials) -> PlanEnd:
    """Where the plan with the free numbers (k,) leads with these masses (b,) and inertias (b, 6).

    The attitude is zero, being relative to itself held constant: its derivatives are what counts.
    """
    inertia: Array = inertials.inertia[:, _PLACE]
    robot = problem.robot.replace(mass=inertials.mass, inertia=inertia)
    motion = replace(problem, robot=robot).motion(free)
    position, quaternion = motion.base_position[-1], motion.base_quaternion[-1]
    planned = jax.lax.stop_gradient(quaternion)
    turn = quaternion_multiply(quaternion_conjugate(planned), quaternion)
    tool = None
    if robot.end_effector_names:
        # Where the tool is in B is a matter of the joints alone, and has no derivative.
        still = State(jnp.zeros(3), jnp.array([1.0, 0.0, 0.0, 0.0]), motion.joint_position[-1])
        tool_B, _ = end_effector_pose(problem.robot, kinematics(problem.robot, still))
        tool = position + quaternion_to_matrix(quaternion) @ tool_B
    return PlanEnd(
        index=problem.objective.smooth(robot, motion),
        attitude=quaternion_to_rotation_vector(turn),
        position=position,
        tool=tool,
    )
