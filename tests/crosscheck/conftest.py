"""Robots and short motions for the cross-checks, which need double precision."""

from pathlib import Path

import jax
import numpy as np
import pytest

import jffsr

jax.config.update("jax_enable_x64", True)

TREE = Path(__file__).parents[1] / "data" / "robots" / "tree_prismatic.yaml"


@pytest.fixture(scope="session")
def tree():
    return jffsr.load_robot(TREE)


@pytest.fixture(scope="session")
def tree_trajectory():
    start, goal = [0.2, -0.1, 0.5, -0.4], [1.0, 0.2, -0.6, 0.7]
    return jffsr.SinePolynomial.between(start, goal, [-2.0] * 4, [2.0] * 4, 2.0)


@pytest.fixture(scope="session")
def tumbled():
    quaternion = np.array([0.8, -0.2, 0.4, 0.4])
    return jffsr.State(
        base_position=np.array([0.3, -1.0, 2.0]),
        base_quaternion=quaternion / np.linalg.norm(quaternion),
        joint_position=np.zeros(4),
    )
