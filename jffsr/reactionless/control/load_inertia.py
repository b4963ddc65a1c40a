"""An unknown load on the last link as ten numbers in which the equations of motion are linear."""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.dynamics.kinematics import Kinematics
from jffsr.robots.robot import Robot
from jffsr.spatial.inertia import skew
from jffsr.types import Array, Matrix, Vector

LOAD_PARAMETERS = 10
"""m, kg; m c (3), kg m; Ixx, Iyy, Izz, Ixy, Ixz, Iyz, kg m^2, about the frame's origin."""


def load_inertias(robot: Robot, kin: Kinematics, body: int, parameters: Vector) -> Array:
    """Spatial inertias (b, 6, 6) about the base's centre of mass, resolved in I, of a load carried by a body.

    All are zero but the body's. parameters (10,), in the frame of the body, about its origin; the result is linear in
    them. body is static.
    """
    rotation, lever = kin.rotation[body], kin.origin[body] - kin.base_position
    mass, first = parameters[0], rotation @ parameters[1:4]
    xx, yy, zz, xy, xz, yz = parameters[4:]
    second = jnp.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    second = rotation @ second @ rotation.T
    # Steiner's theorem, twice: the first moment of a load that is off the origin counts both ways.
    moment = second - _cross(lever, first) - _cross(first, lever) - mass * _cross(lever, lever)
    about_base = skew(first + mass * lever)
    inertia = jnp.block([[mass * jnp.eye(3), -about_base], [about_base, moment]])
    return jnp.zeros((robot.num_joints + 1, 6, 6)).at[body].set(inertia)


def load_parameters(mass: float, com: Array, inertia: Array) -> Vector:
    """The ten numbers (10,) of a load: mass, kg, centre of mass (3,), m, and inertia (3, 3), kg m^2, about it."""
    com = jnp.asarray(com, dtype=float)
    about = jnp.asarray(inertia, dtype=float) - mass * _cross(com, com)
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    return jnp.concatenate([jnp.array([mass]), mass * com, jnp.stack([about[i, j] for i, j in pairs])])


def _cross(a: Vector, b: Vector) -> Matrix:
    return skew(a) @ skew(b)
