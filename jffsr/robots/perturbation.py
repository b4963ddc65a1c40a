"""Robots with random errors in their numbers, each of which a rigid body can still have.

A mass or a length is multiplied by a log-normal factor of mean one, so it stays positive. An inertia is
perturbed through the second moments of the body's mass, S = tr(I)/2 1 - I, which any non-negative density
keeps positive semidefinite, and conversely: that is the triangle inequality. S becomes B S B' with a random
matrix B near one, so that the result is one that a body can have, whatever is drawn. B is made such that S
follows a Wishart distribution. Its mean is then the nominal S exactly, the relative standard deviation of
each second moment is the one asked for in every direction, and the principal axes turn as well (Bartlett 1933
gives the triangular factor that draws it).
"""

from __future__ import annotations

from numbers import Integral

import jax
import numpy as np

from jffsr.errors import InputError
from jffsr.robots.robot import Robot

_LARGEST = 0.5


def perturbed(
    robot: Robot,
    seed: int,
    count: int,
    *,
    mass: float = 0.05,
    inertia: float = 0.05,
    length: float = 0.01,
) -> Robot:
    """`count` robots with random relative errors in masses, inertias and lengths, as one stacked Robot.

    mass, inertia and length are relative standard deviations in [0, 0.5]; means are the nominal numbers. Each
    body has its own mass factor, which its inertia follows; a further error of its second moments of mass,
    which stay positive definite, of standard deviation `inertia`; and a length factor for its points: centre
    of mass, the joints that it carries, its end effectors. Axes, rotations, limits and shapes for drawing stay.
    Every number of the result has a leading axis (count, ...), as `jax.vmap` and `crosscheck_many` take it;
    the same seed gives the same robots. Raises InputError for a count or deviation that makes no sense.
    """
    if not isinstance(count, Integral) or isinstance(count, bool) or count < 1:
        raise InputError(f"count is {count!r}; a positive whole number of robots is expected")
    for what, deviation in (("mass", mass), ("inertia", inertia), ("length", length)):
        if not 0 <= deviation <= _LARGEST:
            raise InputError(
                f"{what} is {deviation!r}; a relative standard deviation in [0, {_LARGEST}] is expected"
            )
    rng = np.random.default_rng(seed)
    topology, bodies = robot.topology, robot.num_joints + 1
    masses = _factors(rng, mass, (count, bodies))
    moments = _second_moments(rng, robot.inertia, inertia, count)
    lengths = _factors(rng, length, (count, bodies))[..., None]

    trace = np.trace(moments, axis1=-2, axis2=-1)[..., None, None]
    stacked = jax.tree.map(lambda leaf: np.repeat(np.asarray(leaf)[None], count, axis=0), robot)
    return stacked.replace(
        mass=stacked.mass * masses,
        inertia=masses[..., None, None] * (trace * np.eye(3) - moments),
        link_com=stacked.link_com * lengths[:, 1:],
        joint_position=stacked.joint_position * lengths[:, list(topology.parents)],
        end_effector_position=stacked.end_effector_position * lengths[:, list(topology.end_effector_bodies)],
        root_position=stacked.root_position * lengths[:, 0],
    )


def _factors(rng: np.random.Generator, deviation: float, shape: tuple[int, ...]) -> np.ndarray:
    """Log-normal factors of mean one and this standard deviation."""
    variance = np.log1p(deviation**2)
    return np.exp(np.sqrt(variance) * rng.standard_normal(shape) - variance / 2)


def _second_moments(rng: np.random.Generator, inertia, deviation: float, count: int) -> np.ndarray:
    """Random second-moment matrices (count, b, 3, 3) about those of the inertias (b, 3, 3)."""
    inertia = np.asarray(inertia, dtype=float)
    nominal = np.trace(inertia, axis1=-2, axis2=-1)[:, None, None] / 2 * np.eye(3) - inertia
    values, axes = np.linalg.eigh(nominal)
    # A flat body has a zero here, which rounding may have made negative.
    root = axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    if deviation == 0:
        return np.broadcast_to(root @ np.swapaxes(root, -1, -2), (count, *inertia.shape)).copy()
    # A Wishart matrix of this many degrees of freedom has the relative variance 2/freedom on its diagonal.
    freedom = 2 / deviation**2
    shape = (count, len(inertia))
    factor = np.zeros((*shape, 3, 3))
    for row in range(3):
        factor[..., row, row] = np.sqrt(rng.chisquare(freedom - row, shape))
        for column in range(row):
            factor[..., row, column] = rng.standard_normal(shape)
    factor = root @ factor / np.sqrt(freedom)
    return factor @ np.swapaxes(factor, -1, -2)
