"""Planning and design together: what a plan's index says of the arm's lengths and of where it is mounted.

At a plan that no change of its free numbers betters, the derivative of the least index by the design is that of the
index at those free numbers held fast (the envelope theorem); `design_gradient` is therefore also the direction in
which a better arm lies.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import program
from jffsr.errors import InputError
from jffsr.objectives.constraints import Constraint
from jffsr.optimizers.constraints import Evaluation
from jffsr.planning.problem import Problem
from jffsr.pytrees import register_dataclass
from jffsr.robots.design import Design, mounted_joints, no_change, redesigned
from jffsr.types import Array, Scalar, Vector


def design_gradient(problem: Problem, free: Vector, mass_exponent: float = 0.0) -> Design:
    """Derivatives of the smooth index by the link lengths (n,), a factor of 1 each, and by the mounts (k, 3), 1/m.

    free (k,) holds a plan's free numbers. mass_exponent is that of `jffsr.redesigned`. Arrays on the host. InputError
    for a problem with an uncertainty.
    """
    _check_certain(problem)
    return jax.device_get(_gradient(problem, np.asarray(free, dtype=float), np.asarray(float(mass_exponent))))


def _check_certain(problem: Problem) -> None:
    if problem.uncertainty is not None:
        raise InputError(
            "the problem has an uncertainty, whose robots a design would not change; leave it out"
        )


@program(once=True)
def _gradient(problem: Problem, free: Vector, mass_exponent: Scalar) -> Design:
    def index(design: Design) -> Scalar:
        return _designed(problem, design, mass_exponent).smooth_and_value(free)[0]

    return jax.grad(index)(jax.tree.map(jnp.asarray, no_change(problem.robot)))


def _designed(problem: Problem, design: Design, mass_exponent: Scalar) -> Problem:
    return replace(problem, robot=redesigned(problem.robot, design, mass_exponent))


@register_dataclass
@dataclass(frozen=True, eq=False)
class CoDesign:
    """A planning problem whose robot's proportions are free numbers too, for `jffsr.solve`.

    A candidate holds the plan's free numbers, then the length factors (n,), each in [1 - length, 1 + length], then
    the shifts of the mounts (k, 3), m, each in [-mount, mount]. A bound of zero leaves that part as it is.
    """

    problem: Problem
    length: Array
    mount: Array
    mass_exponent: Array

    @classmethod
    def within(
        cls, problem: Problem, length: float = 0.2, mount: float = 0.0, mass_exponent: float = 0.0
    ) -> CoDesign:
        """A checked co-design; InputError where a bound makes no robot, and for a problem with an uncertainty."""
        _check_certain(problem)
        if not 0 <= length < 1:
            raise InputError(f"length is {length!r}; the change of a factor of 1, in [0, 1), is expected")
        if not 0 <= mount < np.inf:
            raise InputError(f"mount is {mount!r}; a distance of at least 0 m is expected")
        return cls(problem, *(np.asarray(x, dtype=float) for x in (length, mount, mass_exponent)))

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Those of the problem, which the robot that is chosen has to keep."""
        return self.problem.constraints

    def bounds(self) -> tuple[Vector, Vector]:
        """Lower and upper bounds of a candidate."""
        lower, upper = self.problem.bounds()
        mounts = 3 * len(mounted_joints(self.problem.robot))
        change = jnp.concatenate(
            [
                jnp.broadcast_to(self.length, (self.problem.robot.num_joints,)),
                jnp.broadcast_to(self.mount, (mounts,)),
            ]
        )
        middle = jnp.concatenate([jnp.ones(self.problem.robot.num_joints), jnp.zeros(mounts)])
        return jnp.concatenate([lower, middle - change]), jnp.concatenate([upper, middle + change])

    def split(self, candidate: Vector) -> tuple[Problem, Vector]:
        """The problem with the candidate's robot, and the plan's own free numbers."""
        n, k = self.problem.robot.num_joints, len(mounted_joints(self.problem.robot))
        lengths = candidate.shape[0] - n - 3 * k
        free, length, mount = jnp.split(candidate, [lengths, lengths + n])
        design = Design(length, mount.reshape(k, 3))
        return _designed(self.problem, design, self.mass_exponent), free

    def value(self, candidate: Vector) -> Scalar:
        """The published index of the plan on the robot that the candidate describes."""
        problem, free = self.split(candidate)
        return problem.value(free)

    def smooth_and_value(self, candidate: Vector, looseness: Scalar | float = 1.0) -> tuple[Scalar, Scalar]:
        """The smooth index and the published one."""
        problem, free = self.split(candidate)
        return problem.smooth_and_value(free, looseness)

    def evaluation(self, candidate: Vector, looseness: Scalar | float = 1.0) -> Evaluation:
        """Both, and the constraints."""
        problem, free = self.split(candidate)
        return problem.evaluation(free, looseness)
