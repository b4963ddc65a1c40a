"""One plan over many robots: against the robots one by one, and the nominal robot where nothing is uncertain."""

from __future__ import annotations

from dataclasses import replace

import chex
import jax
import numpy as np
import pytest
from wu6_problems import limited, wu6_problem

from jffsr.errors import InputError
from jffsr.objectives.constraints import FinalAttitude
from jffsr.optimizers.registry import Settings
from jffsr.planning.plan import solve
from jffsr.planning.search import found_index
from jffsr.planning.spread import index_over
from jffsr.planning.uncertainty import Uncertainty
from jffsr.robots.perturbation import perturbed

FREE = 0.4 * np.random.default_rng(11).standard_normal(4)
COUNT = 5


@pytest.fixture(scope="module")
def problem(robots):
    start, goal = np.array([1.5, 0.5]), np.array([-1.0, 1.5])
    return wu6_problem(limited(robots["hu_2011_planar2"]), 50, 20.0, start=start, goal=goal)


@pytest.fixture(scope="module")
def both():
    return jax.jit(lambda problem, free: (problem.smooth_and_value(free), problem.value(free)))


@pytest.mark.parametrize(
    ("measure", "level"),
    [
        pytest.param("expected", 0.0, marks=pytest.mark.slow),
        pytest.param("worst_case", 1.0, marks=pytest.mark.slow),
        ("cvar", 0.6),
    ],
)
def test_the_index_is_that_of_the_robots_one_by_one(problem, both, measure, level):
    uncertain = replace(
        problem, uncertainty=Uncertainty.sampled(problem.robot, COUNT, measure, level=level, seed=3)
    )
    robots = uncertain.uncertainty.robots
    apart = [
        float(both(replace(problem, robot=jax.tree.map(lambda x, k=k: x[k], robots)), FREE)[1])
        for k in range(COUNT)
    ]
    assert np.ptp(apart) > 1e-2 * np.mean(apart)
    worst_first = np.sort(apart)[::-1]
    expected = {"expected": np.mean(apart), "worst_case": np.max(apart), "cvar": np.mean(worst_first[:2])}
    (smooth, value), alone = both(uncertain, FREE)
    np.testing.assert_allclose([value, alone], expected[measure], rtol=1e-12)
    chex.assert_tree_all_finite(smooth)


@pytest.mark.slow
def test_certain_numbers_leave_the_nominal_index(problem, both):
    certain = Uncertainty.sampled(problem.robot, 3, "cvar", mass=0.0, inertia=0.0, length=0.0)
    (_, value), _ = both(replace(problem, uncertainty=certain), FREE)
    np.testing.assert_allclose(value, both(problem, FREE)[1], rtol=1e-10)


def test_the_spread_over_robots_is_that_of_each(problem, both):
    robots = perturbed(problem.robot, 8, COUNT)
    uncertain = replace(problem, uncertainty=Uncertainty(robots, np.array(0.0), np.array(0.05)))
    spread = index_over(uncertain, FREE, robots)
    chex.assert_shape(spread, (COUNT,))
    np.testing.assert_allclose(np.mean(spread), both(uncertain, FREE)[1], rtol=1e-12)


@pytest.mark.slow
def test_a_plan_for_the_worst_case_is_less_bad_in_the_worst_case(problem):
    """Searched alike; certain robots are as many copies of the nominal one, so that both are one program."""
    settings = Settings(particles=16, evaluations=640)
    uncertain = Uncertainty.sampled(problem.robot, 6, "worst_case", seed=1)
    certain = Uncertainty.sampled(problem.robot, 6, "worst_case", mass=0.0, inertia=0.0, length=0.0)
    worst = {}
    for name, uncertainty in (("nominal", certain), ("robust", uncertain)):
        asked = replace(problem, uncertainty=uncertainty)
        plan = solve(asked, "qpso", settings, with_sensitivity=False)
        np.testing.assert_allclose(plan.cost, plan.verification.measure, rtol=1e-12)
        assert "J over 6 robots" in plan.result.sentence
        worst[name] = np.max(index_over(problem, plan.free, uncertain.robots))
    np.testing.assert_allclose(worst["robust"], plan.cost, rtol=1e-12)
    assert worst["robust"] < worst["nominal"]


def test_what_was_found_is_the_index_and_no_merit(problem):
    """Under constraints the search's own number is a merit: the index is the nominal one, or its measure."""
    uncertain = replace(problem, uncertainty=Uncertainty.sampled(problem.robot, 2))
    held = (FinalAttitude(np.array([1.0, 0, 0, 0])),)
    found = {
        (name, len(constraints)): found_index(replace(asked, constraints=constraints), 7.0, 2.0, 3.0)
        for name, asked in (("certain", problem), ("uncertain", uncertain))
        for constraints in ((), held)
    }
    assert found == {("certain", 0): 7, ("certain", 1): 2, ("uncertain", 0): 7, ("uncertain", 1): 3}


@pytest.mark.parametrize(
    ("keywords", "told"),
    [
        ({"measure": "median"}, "measure is 'median'; allowed are expected, worst_case, cvar"),
        ({"level": 1.5}, "level is 1.5; a number in [0, 1] is expected"),
        ({"width": 0.0}, "width is 0.0; a positive number is expected"),
        ({"mass": 0.9}, "mass is 0.9; a relative standard deviation in [0, 0.5] is expected"),
    ],
)
def test_what_makes_no_sense_is_refused(robots, keywords, told):
    with pytest.raises(InputError) as error:
        Uncertainty.sampled(robots["hu_2011_planar2"], 3, **keywords)
    assert told in str(error.value)
