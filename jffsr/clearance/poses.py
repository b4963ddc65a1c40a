"""Poses of all bodies over a grid of joint positions, as components over the grid."""

from __future__ import annotations

from types import ModuleType

import numpy as np

from jffsr.robots.robot import REVOLUTE, Robot
from jffsr.spatial.components import (
    Components,
    Rows,
    add,
    quaternion_rows,
    rows_product,
    rows_times,
    scale,
)
from jffsr.spatial.trigonometry import sine_cosine
from jffsr.types import Array


def body_poses(
    xp: ModuleType, robot: Robot, base_position: Array, base_quaternion: Array, joint_position: Array
) -> tuple[list[Components], list[Rows]]:
    """Position, m, and rotation in I of each body's frame, components (G,), for (G, 3), (G, 4) and (G, n)."""
    origins = [tuple(base_position[:, i] for i in range(3))]
    rotations = [quaternion_rows(tuple(base_quaternion[:, i] for i in range(4)))]
    for i, parent in enumerate(robot.topology.parents):
        q = joint_position[:, i]
        origin = add(origins[parent], rows_times(rotations[parent], vector(robot.joint_position[i])))
        rotation = rows_product(rotations[parent], matrix(robot.joint_rotation[i]))
        x, y, z = vector(robot.joint_axis[i])
        if robot.topology.joint_types[i] == REVOLUTE:
            # Rodrigues' formula: R (1 + sin q K + (1 - cos q) K^2), with K v = axis x v.
            sine, cosine = (np.sin(q), np.cos(q)) if xp is np else sine_cosine(q)
            first = rows_product(rotation, ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
            second = rows_product(first, ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
            rotation = tuple(
                tuple(r + sine * f + (1 - cosine) * s for r, f, s in zip(*rows, strict=True))
                for rows in zip(rotation, first, second, strict=True)
            )
        else:
            origin = add(origin, scale(q, rows_times(rotation, (x, y, z))))
        origins.append(origin)
        rotations.append(rotation)
    return origins, rotations


def vector(values: Array) -> Components:
    """The components of a vector (3,)."""
    return (values[0], values[1], values[2])


def matrix(values: Array) -> Rows:
    """The rows of a matrix (3, 3)."""
    return tuple(vector(values[i]) for i in range(3))
