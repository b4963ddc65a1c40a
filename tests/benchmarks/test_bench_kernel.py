"""The vectorised C++ kernel against the package, and its count of operations. Needs a C++ compiler."""

from __future__ import annotations

import numpy as np
import pytest

import jffsr
from experiments.benchmarks.cases import ROBOTS, Case, initial_state
from experiments.benchmarks.opponents import c_kernel

pytestmark = pytest.mark.native


@pytest.mark.parametrize("name", ROBOTS.values())
def test_kernel_and_package_end_in_the_same_attitude(name):
    case = Case(robot_name=name, batch=11, steps=20)
    found = c_kernel.rollouts(case, 2).run()

    def final(free):
        trajectory = case.trajectory.with_free(free)
        return jffsr.rollout(case.robot, trajectory, initial_state(), num_steps=case.steps).base_quaternion[
            -1
        ]

    np.testing.assert_allclose(found, jffsr.map_batch(final, case.free), rtol=0, atol=1e-13)


def test_operations_grow_with_joints_and_steps():
    two, seven = (
        c_kernel.operations(Case(robot_name=name, steps=10)) for name in ("hu_2011_planar2", "servicer_7dof")
    )
    assert 2 * two < seven < 5 * two
    long = c_kernel.operations(Case(steps=20))
    assert 1.9 * seven < long < 2 * seven
