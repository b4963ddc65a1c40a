"""What the base's attitude needs of the joints, for a whole time grid at once.

Resolved in the base frame, the locked inertia I_B(q) about the system centre of mass and the angular
momentum h_B(q, qd) that the joints carry with the base held do not depend on the attitude:
w_B = I_B^-1 (R' L - h_B). So they are evaluated for every grid point in one go, outside the integration.

Layout: every component of a vector or matrix is an array over (bodies, time); `spatial.components` says why.
Only the sums and products along the tree are loops over joints; all else treats the bodies as one more batch
axis. The
barriers keep the compiler from computing a producer again for each of its consumers. The readable
kinematics in `dynamics` is the test of this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jffsr.robots.robot import Robot, Topology
from jffsr.spatial.components import (
    Components,
    Rows,
    Symmetric,
    add,
    cross,
    dot,
    point_inertia,
    rows_product,
    rows_times,
    scale,
    subtract,
    symmetric_inverse,
    symmetric_times,
)
from jffsr.spatial.inertia import skew
from jffsr.types import Array


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class JointTerms:
    """Base-frame terms on a grid of G points; every component has shape (G,).

    inverse_inertia, 1/(kg m^2), of the locked inertia about the system centre of mass; joint_rate, rad/s,
    I_B^-1 h_B, the base rate that cancels the joints' momentum; com, m, and com_velocity, m/s, of the system
    centre of mass relative to the base.
    """

    inverse_inertia: Symmetric
    joint_rate: Components
    com: Components
    com_velocity: Components

    def base_rate(self, angular_momentum_B: Components) -> Components:
        """Angular velocity of the base in B, rad/s, under an angular momentum resolved in B."""
        return subtract(symmetric_times(self.inverse_inertia, angular_momentum_B), self.joint_rate)


def joint_terms(robot: Robot, joint_position: Array, joint_velocity: Array) -> JointTerms:
    """Terms of a grid of joint positions and rates, (G, n) each."""
    topology = robot.topology
    revolute = topology.is_revolute[:, None]
    q, qd = jnp.asarray(joint_position).T, jnp.asarray(joint_velocity).T
    mass = jnp.asarray(robot.mass)
    total = jnp.sum(mass)

    local, axis, arm = _joint_frames(robot, q, revolute)
    steps = _Step(
        local,
        axis,
        arm,
        jnp.where(revolute, qd, 0.0),
        jnp.where(revolute, 0.0, q),
        jnp.where(revolute, 0.0, qd),
    )
    rotation, origin, omega, velocity = _along_tree(topology, steps)

    lever = rows_times(rotation, _constants(robot.link_com))
    com = add(origin, lever)
    link_mass = mass[1:, None]
    linear = scale(link_mass, add(velocity, cross(omega, lever)))
    own = _turned(rotation, jnp.asarray(robot.inertia)[1:])
    spin = add(symmetric_times(own, omega), cross(com, linear))
    about_base = tuple(o + link_mass * p for o, p in zip(own, point_inertia(com), strict=True))
    com, linear, spin, about_base = jax.lax.optimization_barrier((com, linear, spin, about_base))

    system_com = tuple(jnp.sum(link_mass * c, axis=0) / total for c in com)
    momentum = tuple(jnp.sum(p, axis=0) for p in linear)
    angular = subtract(tuple(jnp.sum(h, axis=0) for h in spin), cross(system_com, momentum))
    base = jnp.asarray(robot.inertia)[0]
    base = (base[0, 0], base[1, 1], base[2, 2], base[0, 1], base[0, 2], base[1, 2])
    locked = tuple(
        own + jnp.sum(part, axis=0) - total * shift
        for own, part, shift in zip(base, about_base, point_inertia(system_com), strict=True)
    )
    inverse = symmetric_inverse(locked)
    terms = JointTerms(
        inverse_inertia=inverse,
        joint_rate=symmetric_times(inverse, angular),
        com=system_com,
        com_velocity=scale(1 / total, momentum),
    )
    return jax.lax.optimization_barrier(terms)


def _constants(values: Array) -> Components:
    """Per-body constants (n, 3) as components of shape (n, 1)."""
    values = jnp.asarray(values)
    return (values[:, 0, None], values[:, 1, None], values[:, 2, None])


class _Step(NamedTuple):
    """What one joint adds to the body that it hangs from: every leaf has the joints as its first axis.

    rotation of the joint's own turn; axis and arm in the parent body's frame, shape (n, 1); turn_rate, slide
    and slide_rate (n, G), zero where the joint is of the other type.
    """

    rotation: Rows
    axis: Components
    arm: Components
    turn_rate: Array
    slide: Array
    slide_rate: Array


class _Body(NamedTuple):
    """Pose and velocity of a body's frame, resolved in the base frame with the base held."""

    rotation: Rows
    origin: Components
    omega: Components
    velocity: Components


def _joint_frames(robot: Robot, q: Array, revolute: np.ndarray) -> tuple[Rows, Components, Components]:
    """Each joint's own turn, and its axis and anchor in the frame of the body that it hangs from."""
    placed, axis = jnp.asarray(robot.joint_rotation), jnp.asarray(robot.joint_axis)
    outer = axis[:, :, None] * axis[:, None, :]
    # Rodrigues: placed (a a' + (1 - a a') cos + [a]x sin), the constant factors multiplied once.
    steady, even, odd = placed @ outer, placed @ (jnp.eye(3) - outer), placed @ skew(axis)
    angle = jnp.where(revolute, q, 0.0)
    cosine, sine = jax.lax.optimization_barrier((jnp.cos(angle), jnp.sin(angle)))
    turn = tuple(
        tuple(
            steady[:, r, k, None] + even[:, r, k, None] * cosine + odd[:, r, k, None] * sine for k in range(3)
        )
        for r in range(3)
    )
    axis_in_parent = jnp.einsum("nij,nj->ni", placed, axis)
    return turn, _constants(axis_in_parent), _constants(robot.joint_position)


def _along_tree(topology: Topology, steps: _Step) -> _Body:
    """Bodies 1 to n, leaves (n, G): one loop over the joints of each unbranched chain of the tree."""
    zero = jnp.zeros_like(steps.turn_rate[0])
    one = zero + 1
    base = _Body(
        ((one, zero, zero), (zero, one, zero), (zero, zero, one)), (zero,) * 3, (zero,) * 3, (zero,) * 3
    )
    parts, order = [], []
    for parent, joints in topology.chains:
        start = base
        if parent > 0:
            place = order.index(parent - 1)
            start = jax.tree.map(lambda *x, place=place: jnp.concatenate(x)[place], *parts)
        first, last = joints[0], joints[-1] + 1
        contiguous = joints == tuple(range(first, last))
        index = slice(first, last) if contiguous else np.array(joints)
        _, bodies = jax.lax.scan(_advance, start, jax.tree.map(lambda x, index=index: x[index], steps))
        parts.append(bodies)
        order.extend(joints)
    bodies = jax.tree.map(lambda *x: jnp.concatenate(x) if len(x) > 1 else x[0], *parts)
    if order == sorted(order):
        return bodies
    return jax.tree.map(lambda x: x[np.argsort(order)], bodies)


def _advance(parent: _Body, step: _Step) -> tuple[_Body, _Body]:
    axis = rows_times(parent.rotation, step.axis)
    arm = add(rows_times(parent.rotation, step.arm), scale(step.slide, axis))
    swing = add(cross(parent.omega, arm), scale(step.slide_rate, axis))
    body = _Body(
        rotation=rows_product(parent.rotation, step.rotation),
        origin=add(parent.origin, arm),
        omega=add(parent.omega, scale(step.turn_rate, axis)),
        velocity=add(parent.velocity, swing),
    )
    return body, body


def _turned(rotation: Rows, inertia: Array) -> Symmetric:
    """Elements of R I R' for constant inertias (n, 3, 3)."""
    constant = tuple(tuple(inertia[:, r, k, None] for k in range(3)) for r in range(3))
    half = jax.lax.optimization_barrier(rows_product(rotation, constant))
    return tuple(dot(half[r], rotation[k]) for r, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
