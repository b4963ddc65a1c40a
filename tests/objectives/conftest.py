"""Motions made of arrays: the terms read nothing else."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr.rollouts.motion import JointGrid, Motion


def made_motion(quaternions, joint_position=None, joint_velocity=None, joint_acceleration=None) -> Motion:
    """A motion of base quaternions (N + 1, 4), w first, and joint arrays (2N + 1, n), zero if not given."""
    quaternions = np.asarray(quaternions, dtype=float)
    size = len(quaternions)
    given = [joint_position, joint_velocity, joint_acceleration]
    n = next((np.shape(x)[1] for x in given if x is not None), 6)
    q, qd, qdd = (np.zeros((2 * size - 1, n)) if x is None else np.asarray(x, dtype=float) for x in given)
    time = np.linspace(0, 1, 2 * size - 1)
    return Motion(
        time=time[::2],
        base_position=np.zeros((size, 3)),
        base_quaternion=quaternions,
        base_twist=np.zeros((size, 6)),
        joint_position=q[::2],
        joint_velocity=qd[::2],
        joint_acceleration=qdd[::2],
        momentum=np.zeros(6),
        joint_grid=JointGrid(time, q, qd, qdd),
    )


@pytest.fixture(scope="session")
def make_motion() -> Callable[..., Motion]:
    return made_motion


@pytest.fixture(scope="session")
def tumbling() -> Motion:
    """A motion through random attitudes within 0.3 rad of one another, from a turned start, joints at random."""
    rng = np.random.default_rng(11)
    start = Rotation.from_rotvec([0.4, -1.0, 2.0])
    steps = Rotation.from_rotvec(np.concatenate([np.zeros((1, 3)), rng.uniform(-0.3, 0.3, (10, 3))]))
    quaternions = np.roll((start * steps).as_quat(), 1, axis=1)
    signs = rng.choice([-1.0, 1.0], (11, 1))
    return made_motion(quaternions * signs, *(rng.normal(size=(21, 6)) for _ in range(3)))
