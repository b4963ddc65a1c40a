"""Batches of plans in one compiled call, and plans as tables for other tools."""

from __future__ import annotations

import csv

import chex
import jax
import numpy as np
import pytest
from scipy.io import loadmat
from wu6_problems import limited, wu6_problem

from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings
from jffsr.planning.many import plan_many
from jffsr.planning.plan import solve
from jffsr.planning.result import ResultCode

SETTINGS = Settings(particles=6, evaluations=30)


@pytest.fixture(scope="module")
def robot(robots):
    return limited(robots["hu_2011_planar2"])


def planar(robot, duration: float, **keywords):
    return wu6_problem(
        robot, 16, duration, start=np.array([1.5, 0.5]), goal=np.array([-1.0, 1.5]), **keywords
    )


@pytest.fixture(scope="module")
def problems(robot):
    return [planar(robot, duration) for duration in (20.0, 25.0, 31.0)]


def test_a_batch_is_planned_and_judged_like_single_plans(problems):
    plans = plan_many(problems, "qpso", SETTINGS, seed=3)
    chex.assert_shape(plans.free, (3, 4))
    chex.assert_shape(plans.motion.base_quaternion, (3, 17, 4))
    chex.assert_tree_all_finite(plans.cost)
    assert plans.result.dtype == np.int32
    np.testing.assert_array_equal(plans.evaluations, 30)
    for i, problem in enumerate(problems):
        value = problem.value(np.asarray(plans.free[i]))
        np.testing.assert_allclose(value, plans.cost[i], rtol=1e-9)
        assert ResultCode(int(plans.result[i])) is not ResultCode.NOT_FINITE
    assert len(set(np.asarray(plans.cost).tolist())) == 3


def test_problems_of_other_structure_are_refused(problems, robot):
    other = planar(robot, 20.0, excursion_limit=None)
    with pytest.raises(InputError, match="problem 3 differs from problem 0"):
        plan_many([*problems, other], "qpso", SETTINGS)
    with pytest.raises(InputError, match="no problem"):
        plan_many([])


def test_tables_hold_the_motion(problems, tmp_path):
    plan = solve(problems[0], "qpso", SETTINGS, with_sensitivity=False)
    assert plan.sensitivity is None
    plan.to_csv(tmp_path / "plan.csv")
    with open(tmp_path / "plan.csv", newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[:2] == ["time [s]", "base_x [m]"]
    assert head[-2:] == ["joint1 rate [rad/s]", "joint2 rate [rad/s]"]
    table = np.array(rows, dtype=float)
    np.testing.assert_array_equal(table[:, 8:10], plan.motion.joint_position)
    np.testing.assert_array_equal(table[:, 4:8], plan.motion.base_quaternion)

    plan.to_mat(tmp_path / "plan.mat")
    stored = loadmat(tmp_path / "plan.mat")
    np.testing.assert_array_equal(stored["base_position"], plan.motion.base_position)
    assert [str(name.item()) for name in stored["joint_names"].ravel()] == ["joint1", "joint2"]

    equal = plan.joint_table(0.7)
    np.testing.assert_allclose(np.diff(equal["time"])[:-1], 0.7)
    assert equal["time"][-1] == 20.0
    position, rate, _ = jax.jit(plan.trajectory)(7.0)
    np.testing.assert_allclose(equal["joint_position"][10], position, rtol=1e-12)
    np.testing.assert_allclose(equal["joint_velocity"][10], rate, rtol=1e-12)
    with pytest.raises(InputError, match="period is 21 s"):
        plan.joint_table(21.0)
