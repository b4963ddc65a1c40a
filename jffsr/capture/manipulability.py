"""How well an arm that holds a target can push it: Wang et al. 2021, section 1.3 and eq. (27), and what is meant there.

With J* the generalized Jacobian of the tool and G the way from the tool's twist to that of the target's centre of
mass, J_c = G J*, the rates of the target per joint rate. As |det G| = 1, the published index sqrt(det(J_c J_c'))
does not see the grasp point at all, and it measures velocity: raising it lowers what the arm can exert. So it stands
under the name `published`, for comparison, and beside it

* `force`: the length (h' J_c J_c' h)^(-1/2) of the ellipsoid of forces on the target that joint torques of unit norm
  hold, along a wrench h of unit length;
* `least_singular_value` of J_c with lengths in units of `length`, the distance from a singularity.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.dynamics.kinematics import kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.inertia import skew
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.types import Array, Matrix, Quaternion, Scalar, Vector, Vector3

PUBLISHED, FORCE, LEAST_SINGULAR_VALUE = "published", "force", "least_singular_value"
MEASURES = (PUBLISHED, FORCE, LEAST_SINGULAR_VALUE)


def grasped_jacobian(
    robot: Robot,
    state: State,
    grasp_T: Vector3,
    target_quaternion: Quaternion,
    end_effector: str | None = None,
) -> Matrix:
    """J_c (6, n): twist in I of the target's centre of mass per joint rate, the target held at grasp_T (3,), m, in T.

    target_quaternion (4,), T to I. Eq. (10), with its sign.
    """
    kin = kinematics(robot, state)
    arm = quaternion_to_matrix(target_quaternion) @ jnp.asarray(grasp_T)
    carried = jnp.block([[jnp.eye(3), skew(arm)], [jnp.zeros((3, 3)), jnp.eye(3)]])
    return carried @ generalized_jacobian(robot, kin, end_effector)


def manipulability(
    jacobian: Matrix, measure: str = FORCE, wrench: Vector | None = None, length: Array | float = 1.0
) -> Scalar:
    """A measure of a Jacobian (6, n), more being better; see the module's text.

    wrench (6,), [force; torque], is the direction of `force`, by default a push along x; length, m, scales the linear
    rows of `least_singular_value`. Raises InputError for a measure that is none.
    """
    if measure not in MEASURES:
        raise InputError(
            f"manipulability '{measure}' is unknown; allowed are {', '.join(MEASURES)}{hint(measure, MEASURES)}"
        )
    if measure == PUBLISHED:
        # The root's derivative at a singularity would not be finite.
        return jnp.sqrt(jnp.maximum(jnp.linalg.det(jacobian @ jacobian.T), 0.0) + 1e-24)
    if measure == FORCE:
        direction = jnp.zeros(6).at[0].set(1.0) if wrench is None else jnp.asarray(wrench)
        direction = direction / jnp.sqrt(direction @ direction)
        needed = jacobian.T @ direction
        return 1 / jnp.sqrt(needed @ needed + 1e-12)
    scaled = jacobian / jnp.concatenate([jnp.full(3, length), jnp.ones(3)])[:, None]
    return jnp.linalg.svd(scaled, compute_uv=False)[-1]
