"""The singular posture nearest to a posture, and whether a singularity is the arm's or that of arm and base.

The generalized Jacobian J* = J_m - J_b H_b^-1 H_bm loses rank in other postures than J_m does. For a base much
heavier than the arm they lie close together; a light base moves them, and some have no neighbour with the base
held (Papadopoulos and Dubowsky, "Dynamic singularities in free-floating space manipulators", 1993). At a zero of
J*, the smallest singular value of J_m alone cannot tell the two apart: it is hardly ever zero, and what is small
depends on the arm. What can is how far the joints must go from there until J_m loses rank too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.dynamics.base_mode import FIXED
from jffsr.robots.robot import Robot
from jffsr.tracking.singularity.measures import in_chunks, posture_jacobians
from jffsr.tracking.singularity.task import ToolTask, joint_scale
from jffsr.types import Array, Scalar, Vector

KINEMATIC, DYNAMIC, MIXED = "kinematic", "dynamic", "mixed"

_LANES = 8
_STEPS = 40
_LONGEST = 0.25  # rad, of a step
# A singular value counts as zero below this many times the root of the rounding, as a share of the largest.
_ZERO = 10.0
# Lost directions agree when the cosine of the angle between them is at least this (26 degrees).
_AGREE = 0.9


@dataclass(frozen=True)
class Bounds:
    """Distances in joint space, rad, that tell kinematic from dynamic: at most the one, and beyond the other."""

    kinematic_within: float = float(np.deg2rad(5.0))
    dynamic_beyond: float = float(np.deg2rad(10.0))


class SingularPosture(NamedTuple):
    """A posture (n,) where a Jacobian loses rank: its distance, rad, from where the search began (infinite where
    none was found), and the lost direction (k,), a unit vector of the task's scaled twists."""

    joint_position: Vector
    distance: Scalar
    direction: Vector


class Nearest(NamedTuple):
    """From a posture to the nearest singular one of J*, and from there to the nearest of J_m.

    alignment: share, 0 to 1, of the direction lost there that is lost with the base held too.
    """

    generalized: SingularPosture
    fixed: SingularPosture
    alignment: Array


def _is_zero(values: Vector) -> Array:
    return values <= _ZERO * jnp.finfo(values.dtype).eps ** 0.5 * values[0]


def _search(jacobian, start: Vector, scale: Vector) -> SingularPosture:
    """Nearest posture to `start` (n,) where jacobian(q) (k, n) loses rank: the linearised condition solved for the
    smallest joint motion from the start, again and again, with steps of limited length.

    The rate of a singular value is u' dJ v. With more joints than directions the lost direction u must lose every
    joint motion v that is free besides, and the other way round.
    """

    def condition(q):
        def twice(p):
            matrix = jacobian(p)
            return matrix, matrix

        rates, matrix = jax.jacfwd(twice, has_aux=True)(q)
        rates = rates * scale
        left, values, right = jnp.linalg.svd(matrix, full_matrices=True)
        rows, columns = matrix.shape
        least = min(rows, columns) - 1
        if rows <= columns:
            linear = jnp.einsum("r,rcj,ic->ij", left[:, least], rates, right[least:])
        else:
            linear = jnp.einsum("ri,rcj,c->ij", left[:, least:], rates, right[least])
        return linear, jnp.zeros(len(linear)).at[0].set(values[least])

    def step(i, q):
        linear, residual = condition(q)
        # The last steps only drive the singular value to zero.
        pull = jnp.where(i < _STEPS - 5, 1.0, 0.0) * (start - q) / scale
        move = pull - jnp.linalg.pinv(linear) @ (residual + linear @ pull)
        length = jnp.sqrt(jnp.sum(move * move))
        return q + scale * move * jnp.minimum(1.0, _LONGEST / jnp.maximum(length, _LONGEST))

    found = jax.lax.fori_loop(0, _STEPS, step, start)
    left, values, _ = jnp.linalg.svd(jacobian(found), full_matrices=False)
    way = (found - start) / scale
    distance = jnp.sqrt(jnp.sum(way * way))
    singular = _is_zero(values)[-1]
    return SingularPosture(found, jnp.where(singular, distance, jnp.inf), left[:, -1])


def _nearest(robot, q, quaternion, end_effector, base_mode, task) -> Nearest:
    scale = jnp.asarray(joint_scale(robot, task))

    def after(start, held):
        def jacobian(p):
            found = posture_jacobians(robot, p, quaternion, end_effector, base_mode, task)
            return jnp.where(held, found.fixed, found.generalized)

        found = _search(jacobian, start, scale)
        left, values, _ = jnp.linalg.svd(jacobian(found.joint_position), full_matrices=False)
        # All that is lost there: two directions may go at once.
        lost = _is_zero(values)
        return found.joint_position, (found, jnp.where(lost, left, 0.0))

    # One loop, hence one compiled search, for both.
    _, (both, lost) = jax.lax.scan(after, q, jnp.array([False, True]))
    generalized, fixed = (jax.tree.map(lambda leaf, i=i: leaf[i], both) for i in (0, 1))
    if base_mode == FIXED:
        return Nearest(generalized, generalized._replace(distance=jnp.zeros(())), jnp.ones(()))
    shares = lost[1].T @ generalized.direction
    return Nearest(generalized, fixed, jnp.sqrt(jnp.sum(shares * shares)))


def _many(robot, q, quaternion, end_effector, base_mode, task):
    return jax.vmap(lambda a, b: _nearest(robot, a, b, end_effector, base_mode, task))(q, quaternion)


_many_jit = jit(_many, static_argnums=(3, 4, 5))


def nearest_singular(
    robot: Robot,
    joint_position: np.ndarray,
    base_quaternion: np.ndarray,
    end_effector: str | None,
    base_mode: str,
    task: ToolTask,
) -> Nearest:
    """The nearest singular postures to postures (p, n) at base attitudes (p, 4), as host arrays with p in front."""
    return in_chunks(
        lambda q, quaternion: _many_jit(robot, q, quaternion, end_effector, base_mode, task),
        _LANES,
        joint_position,
        base_quaternion,
    )


def kind_of(posture_distance: float, fixed_distance: float, alignment: float, bounds: Bounds) -> str:
    """Kinematic, dynamic, or mixed where neither can be said.

    posture_distance, rad, to the nearest singular posture of J*; fixed_distance, rad, from there to the nearest
    one of J_m; alignment as in Nearest.
    """
    if not np.isfinite(posture_distance):
        return MIXED
    if fixed_distance <= bounds.kinematic_within and alignment >= _AGREE:
        return KINEMATIC
    return DYNAMIC if fixed_distance > bounds.dynamic_beyond else MIXED
