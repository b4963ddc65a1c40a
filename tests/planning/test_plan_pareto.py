"""Terms of an index against each other, on the planar two-link arm."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest
from planar_problems import planar
from wu6_problems import limited

from jffsr.errors import InputError
from jffsr.objectives.constraints import FinalAttitude
from jffsr.planning.pareto import plan_pareto
from jffsr.planning.uncertainty import Uncertainty

RATES = ("joint_rate", "joint_acceleration")


@pytest.fixture(scope="module")
def problem(robots):
    """Too little time for the limits of rate: how much they are overrun stands against the base's turn."""
    return planar(limited(robots["hu_2011_planar2"]), 18.0, excursion_limit=None)


@pytest.mark.slow
def test_turn_of_the_base_against_overrun_rates(problem):
    found = plan_pareto(problem, ["attitude_change", RATES], 80, population=8, polish_iterations=24)
    assert len(found.points) >= 2
    assert found.evaluations == 80
    assert found.hypervolume >= found.hypervolume_before > 0
    assert np.all(np.diff(found.values[:, 0]) > 0)
    assert np.all(np.diff(found.values[:, 1]) < 0)
    terms = jax.jit(jax.vmap(problem.terms))(found.points)
    np.testing.assert_allclose(found.values[:, 0], terms["attitude_change"].weighted, rtol=1e-9, atol=1e-9)
    both = sum(terms[name].weighted for name in RATES)
    np.testing.assert_allclose(found.values[:, 1], both, rtol=1e-9, atol=1e-9)
    lower, upper = problem.bounds()
    assert np.all((found.points >= lower) & (found.points <= upper))


def test_bad_groups_are_refused(problem):
    with pytest.raises(InputError, match=r"'joint_rat' is no term of the index.*did you mean 'joint_rate'"):
        plan_pareto(problem, ["attitude_change", "joint_rat"])
    for groups in (
        ["attitude_change"],
        [("attitude_change", *RATES)],
        ["attitude_change", *RATES, "joint_rate"],
    ):
        with pytest.raises(
            InputError, match="each of attitude_change, joint_rate, joint_acceleration stands once"
        ):
            plan_pareto(problem, groups)
    constrained = replace(problem, constraints=(FinalAttitude(np.array([1.0, 0, 0, 0])),))
    with pytest.raises(InputError, match="the problem has constraints"):
        plan_pareto(constrained)


def test_an_uncertain_problem_is_refused(problem):
    uncertain = replace(problem, uncertainty=Uncertainty.sampled(problem.robot, 2))
    with pytest.raises(InputError, match="the problem has an uncertainty"):
        plan_pareto(uncertain, ["attitude_change", RATES])
