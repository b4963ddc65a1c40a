"""Spatial vectors along the tree, for algorithms whose cost grows linearly with the number of joints.

Every spatial vector of a state is resolved in I and taken about one and the same point O, which stands still
where the base's centre of mass is at that instant (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter
2, in the order [linear; angular]). So nothing is transformed from body to body: what the tree adds up is added
up. A spatial acceleration at O is not the derivative of a body's velocity there: for the base,
d/dt v_0 = a_O + w_0 x v_0.
"""

from __future__ import annotations

import jax.numpy as jnp

from jffsr.dynamics.kinematics import Kinematics
from jffsr.robots.robot import Robot
from jffsr.spatial.inertia import parallel_axis, skew
from jffsr.types import Array, Twist, Vector


def motion_subspace(robot: Robot, kin: Kinematics) -> Array:
    """Twist (n, 6) about O of each joint per unit of its rate."""
    turning = robot.topology.is_revolute[:, None]
    lever = kin.anchor - kin.base_position
    linear = jnp.where(turning, jnp.cross(lever, kin.axis), kin.axis)
    return jnp.concatenate([linear, jnp.where(turning, kin.axis, 0.0)], axis=-1)


def spatial_inertias(robot: Robot, kin: Kinematics) -> Array:
    """Inertia (b, 6, 6) of each body about O: momentum [P; L about O] per twist."""
    mass = jnp.asarray(robot.mass)[:, None, None]
    lever = kin.com - kin.base_position
    first = mass * skew(lever)
    diagonal = mass * jnp.eye(3)
    moment = kin.inertia_I + mass * parallel_axis(lever)
    return jnp.concatenate(
        [jnp.concatenate([diagonal, -first], axis=-1), jnp.concatenate([first, moment], axis=-1)], axis=-2
    )


def body_twists(robot: Robot, kin: Kinematics, base_twist: Twist, joint_velocity: Vector) -> Array:
    """Twist (b, 6) about O of each body."""
    steps = motion_subspace(robot, kin) * joint_velocity[:, None]
    return outwards(robot.topology.parents, base_twist, steps)


def outwards(parents: tuple[int, ...], base: Array, steps: Array) -> Array:
    """Values (b, ...) of all bodies: the base's (...), and each other's its parent's plus its step (n, ...)."""
    values = [jnp.asarray(base)]
    for joint, parent in enumerate(parents):
        values.append(values[parent] + steps[joint])
    return jnp.stack(values)


def inwards(parents: tuple[int, ...], values: Array) -> Array:
    """Sums (b, ...) of what each body carries: its own value (b, ...) and those of all bodies outside it."""
    totals = list(values)
    for joint in reversed(range(len(parents))):
        totals[parents[joint]] = totals[parents[joint]] + totals[joint + 1]
    return jnp.stack(totals)


def cross_motion(v: Array, m: Array) -> Array:
    """v x m (..., 6): the rate at which a twist m that is carried along with v changes."""
    linear = jnp.cross(v[..., 3:], m[..., :3]) + jnp.cross(v[..., :3], m[..., 3:])
    return jnp.concatenate([linear, jnp.cross(v[..., 3:], m[..., 3:])], axis=-1)


def cross_force(v: Array, f: Array) -> Array:
    """v x* f (..., 6): the rate at which a momentum or wrench f that is carried along with v changes."""
    angular = jnp.cross(v[..., 3:], f[..., 3:]) + jnp.cross(v[..., :3], f[..., :3])
    return jnp.concatenate([jnp.cross(v[..., 3:], f[..., :3]), angular], axis=-1)
