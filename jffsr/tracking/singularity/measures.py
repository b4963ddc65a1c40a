"""The task's Jacobians of many postures: with the base giving way, and with the base held."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.compiling import jit
from jffsr.dynamics.kinematics import end_effector_pose, jacobians, kinematics
from jffsr.dynamics.momentum import generalized_jacobian
from jffsr.robots.robot import Robot
from jffsr.robots.state import State
from jffsr.spatial.rotation import quaternion_to_matrix
from jffsr.tracking.singularity.task import TOOL, ToolTask, joint_scale
from jffsr.types import Array, Matrix, Matrix3, Quaternion, Vector, Vector3

# One compiled program whatever the number of postures: they go through it so many at a time.
LANES = 64


class PostureJacobians(NamedTuple):
    """The task's scaled Jacobians (k, n), m/rad: generalized J*, and J_m with the base held; the tool's pose.

    tool_rotation (3, 3), E to I; tool_offset (3,), m, from the base's centre of mass to the tool, in I.
    """

    generalized: Matrix
    fixed: Matrix
    tool_rotation: Matrix3
    tool_offset: Vector3


def posture_jacobians(
    robot: Robot,
    joint_position: Vector,
    base_quaternion: Quaternion,
    end_effector: str | None,
    base_mode: str,
    task: ToolTask,
) -> PostureJacobians:
    """Both Jacobians of one posture, joint_position (n,), at a base attitude (4,)."""
    kin = kinematics(robot, State(jnp.zeros(3), base_quaternion, joint_position))
    position, quaternion = end_effector_pose(robot, kin, end_effector)
    rotation = quaternion_to_matrix(quaternion)

    def scaled(matrix: Matrix) -> Matrix:
        if task.frame == TOOL:
            matrix = jnp.concatenate([rotation.T @ matrix[:3], rotation.T @ matrix[3:]])
        return matrix[task.rows] * task.row_scale[:, None] * joint_scale(robot, task)

    return PostureJacobians(
        scaled(generalized_jacobian(robot, kin, end_effector, base_mode)),
        scaled(jacobians(robot, kin, end_effector)[1]),
        rotation,
        position,
    )


def _many(robot, joint_position, base_quaternion, end_effector, base_mode, task):
    def one(q, quaternion):
        return posture_jacobians(robot, q, quaternion, end_effector, base_mode, task)

    return jax.vmap(one)(joint_position, base_quaternion)


_many_jit = jit(_many, static_argnums=(3, 4, 5))


def many_jacobians(
    robot: Robot,
    joint_position: np.ndarray,
    base_quaternion: np.ndarray,
    end_effector: str | None,
    base_mode: str,
    task: ToolTask,
) -> PostureJacobians:
    """The same of postures (p, n) and attitudes (p, 4), as host arrays."""
    return in_chunks(
        lambda q, quaternion: _many_jit(robot, q, quaternion, end_effector, base_mode, task),
        LANES,
        joint_position,
        base_quaternion,
    )


def in_chunks(function, lanes: int, *arrays: np.ndarray):
    """A function of arrays with a common leading axis, called on `lanes` of them at a time, the last repeated."""
    count, parts = len(arrays[0]), []
    for first in range(0, count, lanes):
        chosen = np.minimum(np.arange(first, first + lanes), count - 1)
        parts.append(jax.device_get(function(*(np.asarray(array)[chosen] for array in arrays))))
    return jax.tree.map(lambda *leaves: np.concatenate(leaves)[:count], *parts)


class Measures(NamedTuple):
    """How far matrices (p, k, n) are from losing rank, as host arrays.

    singular_values (p, min(k, n)), m, largest first; determinant (p,), or None where the matrices are not
    square; manipulability (p,), the product of the singular values (Yoshikawa 1985); condition_number (p,).
    """

    singular_values: Array
    determinant: Array | None
    manipulability: Array
    condition_number: Array


def measures(matrices: np.ndarray) -> Measures:
    """The measures of matrices (p, k, n)."""
    values = np.linalg.svd(matrices, compute_uv=False)
    square = matrices.shape[-1] == matrices.shape[-2]
    # Zero divides to infinity, which is the condition number of a singular matrix.
    with np.errstate(divide="ignore", invalid="ignore"):
        condition = np.where(values[:, -1] > 0, values[:, 0] / values[:, -1], np.inf)
    return Measures(values, np.linalg.det(matrices) if square else None, np.prod(values, axis=-1), condition)
