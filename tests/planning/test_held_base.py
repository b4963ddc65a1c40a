"""A plan whose base is held: the same search, judged by what that base conserves."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import numpy as np
import pytest

from jffsr.dynamics.base_mode import ATTITUDE_HELD, FIXED
from jffsr.objectives.composite import composite_index
from jffsr.optimizers.registry import Settings
from jffsr.planning.plan import solve
from jffsr.planning.problem import Problem
from jffsr.planning.result import ResultCode
from jffsr.robots.robot import Limits
from jffsr.trajectories.sine_polynomial import SinePolynomial

MOMENTUM = np.array([20.0, -10.0, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def problem(robots):
    limits = Limits.symmetric(2, position=3.0, velocity=3.0, acceleration=3.0)
    robot = robots["hu_2011_planar2"].replace(limits=limits)
    start, goal = np.array([0.2, 0.4]), np.array([0.9, -0.6])
    trajectory = SinePolynomial.between(start, goal, limits.position_lower, limits.position_upper, 12.0)
    index = composite_index(robot, joint_goal=goal, excursion_limit=0.1, tool_position=1e-3)
    return Problem(robot, trajectory, index, momentum=MOMENTUM, num_steps=60, base_mode=ATTITUDE_HELD)


def test_a_plan_with_the_attitude_held_is_met_and_verified(problem):
    plan = solve(problem, "qpso", Settings(particles=4, evaluations=16), with_sensitivity=False)
    assert plan.result.code == ResultCode.ACCURACY_MET, plan.result.sentence
    assert plan.motion.base_mode == ATTITUDE_HELD
    assert float(plan.terms["attitude_change"].value) == 0.0
    assert float(plan.verification.momentum_drift) < 1e-6
    assert float(plan.verification.position_difference) < 1e-6
    travelled = plan.motion.base_position[-1] - plan.motion.base_position[0]
    assert np.linalg.norm(travelled) > 0.1


def test_a_fixed_base_stays_where_it_is(problem):
    fixed = replace(problem, base_mode=FIXED, momentum=np.zeros(6))
    lower, _ = fixed.bounds()
    motion = jax.jit(fixed.motion)(np.zeros(lower.shape))
    chex.assert_tree_all_finite(motion)
    np.testing.assert_array_equal(motion.base_position, 0.0)
    np.testing.assert_array_equal(motion.base_twist, 0.0)
