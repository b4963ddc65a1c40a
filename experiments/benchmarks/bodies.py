"""A robot's numbers for programs outside JAX: frames turned so that z is each body's joint axis.

Engines are fastest with joints about a coordinate axis, so all opponents that are built from numbers get these.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import jffsr
from experiments.benchmarks.cases import Case


@dataclass(frozen=True)
class Bodies:
    """Joint i hangs from body parents[i] (0 is the base) and moves body i + 1.

    rotation (n, 3, 3) and offset (n, 3) place the frame of body i + 1 in that of its parent at joint position
    zero; mass (n + 1,); com (n + 1, 3); inertia (n + 1, 3, 3) about the centre of mass. All joints turn about z.
    """

    parents: tuple[int, ...]
    rotation: np.ndarray
    offset: np.ndarray
    mass: np.ndarray
    com: np.ndarray
    inertia: np.ndarray


def turned_bodies(robot) -> Bodies:
    """The bodies of a robot whose joints all turn."""
    assert robot.topology.is_revolute.all(), "the native opponents know turning joints only"
    turn = [np.eye(3), *(z_along(np.asarray(axis, float)) for axis in robot.joint_axis)]
    parents = robot.topology.parents
    rotation = [
        turn[p].T @ np.asarray(robot.joint_rotation[i], float) @ turn[i + 1] for i, p in enumerate(parents)
    ]
    offset = [turn[p].T @ np.asarray(robot.joint_position[i], float) for i, p in enumerate(parents)]
    com = [np.zeros(3), *(turn[i + 1].T @ np.asarray(c, float) for i, c in enumerate(robot.link_com))]
    inertia = [a.T @ np.asarray(tensor, float) @ a for a, tensor in zip(turn, robot.inertia, strict=True)]
    return Bodies(
        parents=parents,
        rotation=np.array(rotation),
        offset=np.array(offset),
        mass=np.asarray(robot.mass, float),
        com=np.array(com),
        inertia=np.array(inertia),
    )


def plain_urdf(robot) -> str:
    """The robot as URDF without limits of acceleration, which are no part of the format and which readers report."""
    unlimited = np.full(robot.num_joints, np.inf)
    return jffsr.to_urdf(robot.replace(limits=replace(robot.limits, acceleration=unlimited)))


def z_along(axis: np.ndarray) -> np.ndarray:
    """A rotation matrix whose third column is this unit vector."""
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def law_table(case: Case) -> np.ndarray:
    """The sine-polynomial law's functions of time, (2 steps + 1, 6): see native/law.hpp."""
    s = np.linspace(0.0, 1.0, 2 * case.steps + 1)
    duration = float(case.trajectory.duration)
    ramp, bump = s**3 * (10 - 15 * s + 6 * s**2), 64 * (s * (s - 1)) ** 3
    ramp_1, bump_1 = 30 * (s * (s - 1)) ** 2, 192 * (s * (s - 1)) ** 2 * (2 * s - 1)
    columns = (ramp, ramp_1 / duration, bump, bump_1 / duration, 2 * s - 1, 2 * bump / duration)
    return np.ascontiguousarray(np.stack(columns, axis=1))


def law_joints(case: Case) -> np.ndarray:
    """Its constants, (n, 4): middle and half width of the limits, arcsine at the start, its way to the goal."""
    law = case.trajectory
    start, goal, lower, upper = (np.asarray(x, float) for x in (law.start, law.goal, law.lower, law.upper))
    middle, half = (upper + lower) / 2, (upper - lower) / 2
    u0, u1 = np.arcsin((start - middle) / half), np.arcsin((goal - middle) / half)
    return np.ascontiguousarray(np.stack([middle, half, u0, u1 - u0], axis=1))
