"""Random robots and states: trees of 1 to 10 joints, revolute and prismatic, with inertias that bodies can have."""

from __future__ import annotations

import jax
import numpy as np

from jffsr.robots.robot import PRISMATIC, REVOLUTE, Limits, Robot, Topology
from jffsr.robots.state import State

MOST_JOINTS = 10


def random_topology(rng: np.random.Generator, num_joints: int) -> Topology:
    """A tree whose joints mostly go on from the last body and sometimes branch off an earlier one."""
    parents = [0]
    for joint in range(1, num_joints):
        parents.append(joint if rng.random() < 0.7 else int(rng.integers(0, joint + 1)))
    kinds = [PRISMATIC if rng.random() < 0.25 else REVOLUTE for _ in parents]
    return Topology(
        name="random",
        parents=tuple(parents),
        joint_types=tuple(kinds),
        joint_names=tuple(f"joint{i + 1}" for i in range(num_joints)),
        body_names=("base", *(f"body{i + 1}" for i in range(num_joints))),
        end_effector_names=("tool",),
        end_effector_bodies=(num_joints,),
    )


def random_rotation(rng: np.random.Generator) -> np.ndarray:
    """A rotation matrix, uniform."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def random_inertia(rng: np.random.Generator, mass: float, size: float) -> np.ndarray:
    """The inertia of a body whose second moments along its principal axes lie in a range of 1 to 20."""
    spread = mass * size**2 * rng.uniform(0.05, 1.0, 3)
    axes = random_rotation(rng)
    return axes @ np.diag(spread.sum() - spread) @ axes.T


def random_robot(rng: np.random.Generator, topology: Topology) -> Robot:
    """A robot of a topology: a base of 20 to 500 kg, links of 1 to 20 kg and a few tenths of a metre."""
    n = len(topology.parents)
    mass = np.concatenate([rng.uniform(20, 500, 1), np.exp(rng.uniform(0, 3, n))])
    size = np.concatenate([rng.uniform(0.4, 1.0, 1), rng.uniform(0.15, 0.4, n)])
    axis = rng.normal(size=(n, 3))
    return Robot(
        mass=mass,
        inertia=np.array([random_inertia(rng, m, s) for m, s in zip(mass, size, strict=True)]),
        link_com=rng.uniform(-0.4, 0.4, (n, 3)),
        joint_position=rng.uniform(-0.8, 0.8, (n, 3)),
        joint_rotation=np.array([random_rotation(rng) for _ in range(n)]),
        joint_axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        end_effector_position=rng.uniform(-0.5, 0.5, (1, 3)),
        end_effector_rotation=random_rotation(rng)[None],
        root_position=np.zeros(3),
        limits=Limits.symmetric(n),
        topology=topology,
    )


def random_quaternion(rng: np.random.Generator) -> np.ndarray:
    """A unit quaternion, uniform."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def random_state(rng: np.random.Generator, num_joints: int, speed: float) -> State:
    """A state whose linear velocities, m/s, and rates, rad/s, are of the size of `speed`."""
    return State(
        base_position=rng.uniform(-2, 2, 3),
        base_quaternion=random_quaternion(rng),
        joint_position=rng.uniform(-2, 2, num_joints),
        base_twist=speed * rng.normal(size=6),
        joint_velocity=speed * rng.normal(size=num_joints),
    )


def stacked(trees: list):
    """One tree whose leaves have a leading axis over the given ones."""
    return jax.tree.map(lambda *leaves: np.stack(leaves), *trees)
