"""A robot of other proportions: link lengths and where the arms are mounted, as numbers to differentiate by."""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from jffsr.pytrees import register_dataclass
from jffsr.robots.robot import Robot
from jffsr.types import Array, Scalar


@register_dataclass
@dataclass(frozen=True)
class Design:
    """Changes to a robot.

    length (n,), factors of the links: each multiplies the points of its body (centre of mass, the joints that it
    carries, its end effectors) and, squared, its inertia, as when a body keeps its mass and is made larger; mount
    (k, 3), m, in B, shifts of the joints that the base carries, in the order of `mounted_joints`.
    """

    length: Array
    mount: Array


def mounted_joints(robot: Robot) -> tuple[int, ...]:
    """Indices of the joints that the base carries, k of them."""
    return tuple(joint for joint, parent in enumerate(robot.topology.parents) if parent == 0)


def no_change(robot: Robot) -> Design:
    """The design that leaves a robot as it is."""
    return Design(np.ones(robot.num_joints), np.zeros((len(mounted_joints(robot)), 3)))


def redesigned(robot: Robot, design: Design, mass_exponent: Scalar | float = 0.0) -> Robot:
    """The robot with a design's changes; differentiable.

    A link's mass is multiplied by its length factor to the power of mass_exponent (0: the mass stays, 1: the mass of a
    metre stays), its inertia by that and by the square of the factor.
    """
    length = jnp.asarray(design.length)
    of_body = jnp.concatenate([jnp.ones(1, dtype=length.dtype), length])
    topology = robot.topology
    parents, carriers = (
        np.array(topology.parents, dtype=int),
        np.array(topology.end_effector_bodies, dtype=int),
    )
    joint_position = jnp.asarray(robot.joint_position) * of_body[parents][:, None]
    mounted = np.array(mounted_joints(robot), dtype=int)
    heavier = of_body**mass_exponent
    return robot.replace(
        mass=jnp.asarray(robot.mass) * heavier,
        inertia=jnp.asarray(robot.inertia) * (heavier * of_body**2)[:, None, None],
        link_com=jnp.asarray(robot.link_com) * length[:, None],
        joint_position=joint_position.at[mounted].add(jnp.asarray(design.mount)),
        end_effector_position=jnp.asarray(robot.end_effector_position) * of_body[carriers][:, None],
    )
