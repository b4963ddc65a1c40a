"""Small plans of the six-axis arm from search to verification, all through the same compiled programs."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import chex
import jax
import numpy as np
import pytest
from wu6_problems import GOAL, START, limited, wu6_problem

from jffsr.compiling import Program
from jffsr.errors import InputError
from jffsr.optimizers import driver
from jffsr.optimizers.registry import Settings
from jffsr.planning import plan as plan_module
from jffsr.planning.plan import SearchInterrupted, solve
from jffsr.planning.result import ResultCode, Tolerances, explain, result_code
from jffsr.planning.sensitivity import sensitivity
from jffsr.rollouts.conservation import momentum_drift
from jffsr.rollouts.rollout import rollout

SETTINGS = Settings(
    particles=8, swarm_evaluations=24, starts=2, gradient_iterations=12, polish_iterations=8, memory=4
)
# Twenty steps are few: they leave an attitude error of some microradians.
COARSE = Tolerances(attitude=1e-3, momentum=1e-3)


@pytest.fixture(scope="module", autouse=True)
def counted_traces():
    """Every run of this module is traced once for the swarm, once for both descents, once for the check."""
    with pytest.MonkeyPatch.context() as patch:
        advance = chex.assert_max_traces(driver._advance, n=2)
        verified = chex.assert_max_traces(plan_module._verified.__wrapped__, n=1)
        patch.setattr(driver, "_advance_jit", Program(advance, static_argnums=4))
        patch.setattr(plan_module, "_verified", Program(verified, static_argnums=2))
        yield


@pytest.fixture(scope="module")
def robot(robots):
    return limited(robots["wu_2018_6dof"])


@pytest.fixture(scope="module")
def problem(robot):
    return wu6_problem(robot, num_steps=20)


def planned(problem, **keywords):
    keywords = {"with_sensitivity": False, **keywords}
    return solve(problem, "hybrid", SETTINGS, chunk=6, tolerances=COARSE, **keywords)


@pytest.fixture(scope="module")
def plan(problem):
    return planned(problem)


def test_plan_is_consistent(problem, plan):
    total = sum(float(term.weighted) for term in plan.terms.values())
    assert plan.cost == pytest.approx(total, rel=1e-9)
    assert plan.verification.cost == pytest.approx(plan.cost, rel=1e-2)
    lower, upper = problem.bounds()
    assert np.all((plan.free >= lower) & (plan.free <= upper))
    np.testing.assert_array_equal(plan.trajectory.coefficients, plan.free.reshape(2, 6).T)
    assert plan.result.code in (
        ResultCode.ACCURACY_MET,
        ResultCode.ACCURACY_NOT_MET,
        ResultCode.NOT_CONVERGED,
        ResultCode.LIMITS_VIOLATED,
    )
    assert plan.seconds["total"] >= plan.seconds["run"] >= 0


@pytest.mark.slow
def test_sensitivity_is_that_of_the_chosen_free_numbers(problem):
    plan = planned(problem, with_sensitivity=True)
    assert plan.sensitivity.bodies == problem.robot.body_names
    expected = sensitivity(problem, plan.free)
    np.testing.assert_array_equal(plan.sensitivity.derivative.tool.inertia, expected.derivative.tool.inertia)
    sizes = [row.tool for row in plan.sensitivity.per_percent]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] > 0


def test_history_and_counts(plan):
    best = [record.best_value for record in plan.history]
    assert all(b <= a for a, b in pairwise(best))
    assert best[-1] == plan.cost
    swarm = min(record.best_value for record in plan.history if record.phase == 0)
    assert plan.cost < 0.9 * swarm
    assert (plan.evaluations, plan.history[-1].gradient_evaluations) == (24, plan.gradient_evaluations)
    assert 0 < plan.gradient_evaluations <= 2 * 20
    assert plan.first_at(plan.cost).best_value == plan.cost
    assert plan.first_at(-1.0) is None


def test_boundary_conditions(plan):
    motion = plan.motion
    np.testing.assert_allclose(motion.joint_position[0], START, atol=1e-14)
    np.testing.assert_allclose(motion.joint_position[-1], GOAL, atol=1e-14)
    for end in (0, -1):
        np.testing.assert_allclose(motion.joint_velocity[end], 0.0, atol=1e-14)
        np.testing.assert_allclose(motion.joint_acceleration[end], 0.0, atol=1e-14)
    assert plan.verification.boundary_error < 1e-13
    assert motion.time[-1] == 30.0


def test_same_seed_gives_the_same_plan(problem, plan):
    again = planned(problem)
    np.testing.assert_array_equal(again.free, plan.free)
    assert again.history == plan.history
    assert planned(problem, seed=1).history != plan.history


def test_other_numbers_share_the_compiled_programs(robot):
    """Other masses, limits, goals, durations and momenta: the traces are counted for the whole module."""
    heavier = robot.replace(mass=np.asarray(robot.mass) * 1.5)
    for other in (
        wu6_problem(heavier, num_steps=20),
        wu6_problem(limited(robot, 0.5, 0.4), num_steps=20),
        wu6_problem(robot, num_steps=20, goal=START + 0.3),
        wu6_problem(robot, num_steps=20, duration=40.0, momentum=[0.0, 0.0, 0.0, 0.1, 0.0, 0.2]),
    ):
        outcome = planned(other, seed=2)
        assert np.isfinite(outcome.cost)
        assert outcome.cost == pytest.approx(sum(float(t.weighted) for t in outcome.terms.values()), rel=1e-9)


@pytest.mark.parametrize("count", [50, pytest.param(1000, marks=pytest.mark.slow)])
def test_many_plans_of_one_robot_compile_nothing_again(robot, problem, plan, count):
    """Tasks, durations, masses and seeds vary; budgets, being traced, are cut to a few evaluations."""
    if count > 50:
        planned(problem, with_sensitivity=True)
    few = replace(SETTINGS, swarm_evaluations=8, gradient_iterations=1, polish_iterations=1)
    draw = np.random.default_rng(0)
    for seed in range(count):
        other = robot.replace(mass=np.asarray(robot.mass) * draw.uniform(0.5, 2.0, robot.mass.shape))
        problem = wu6_problem(
            other, num_steps=20, duration=draw.uniform(25, 40), start=START + draw.normal(0, 0.02, 6)
        )
        found = solve(
            problem, "hybrid", few, seed=seed, chunk=6, tolerances=COARSE, with_sensitivity=count > 50
        )
        # What was traced would have been compiled, and counted here.
        assert found.seconds["compile"] == 0
        assert np.isfinite(found.cost)


def test_too_coarse_a_grid_is_not_verified(problem, plan):
    """Violent free numbers in twenty steps: the finer run ends elsewhere."""
    wild = np.tile([2.5, -2.5], 6)
    verification = plan_module._verified(problem, jax.numpy.asarray(wild), 4)[2]
    assert verification.attitude_difference > Tolerances().attitude
    code = result_code(problem, verification, np.array(True), Tolerances())
    assert code == ResultCode.NOT_VERIFIED
    sentence = explain(int(code), problem, verification, Tolerances()).sentence
    assert "attitude difference of" in sentence
    assert "raise rollout.num_steps" in sentence


def test_overrun_limits_are_reported_on_the_finer_grid(robot, problem):
    """Without the terms' weight on them, limits are judged all the same."""
    slow = limited(robot, 0.02, 0.005)
    lenient = replace(problem, robot=slow, objective=replace(problem.objective, accuracy=1e9))
    verification = plan_module._verified(lenient, jax.numpy.zeros(12), 4)[2]
    code = result_code(lenient, verification, np.array(True), COARSE)
    assert code == ResultCode.LIMITS_VIOLATED
    sentence = explain(int(code), lenient, verification, COARSE).sentence
    trajectory = lenient.trajectory
    peak = np.max(np.abs(np.asarray(jax.vmap(trajectory)(np.linspace(0, 30, 161))[1])[:, 0]))
    assert f"rate of joint1 by {100 * (peak / 0.02 - 1):.3g} %" in sentence
    assert "acceleration of joint6" in sentence


def test_not_a_number_everywhere_is_not_finite(problem):
    terms = tuple(
        replace(term, scale=np.array(np.nan)) if term.name == "joint_rate" else term
        for term in problem.objective.terms
    )
    outcome = planned(replace(problem, objective=replace(problem.objective, terms=terms)))
    assert outcome.result.code is ResultCode.NOT_FINITE
    assert outcome.cost == np.inf


def test_interrupted(problem, plan):
    """The search stops between chunks, hands out what it had, and goes on from its snapshot to the same plan."""
    snapshots, asked = [], iter([False, False, True])
    with pytest.raises(SearchInterrupted) as caught:
        planned(problem, on_chunk=snapshots.append, interrupted=lambda: next(asked))
    outcome = caught.value.outcome
    assert outcome.interrupted
    assert outcome.history == snapshots[-1].history
    resumed = planned(problem, resume=snapshots[-1])
    np.testing.assert_array_equal(resumed.free, plan.free)
    assert resumed.history == plan.history


def test_motion_of_another_robot_is_caught(robot, problem, plan):
    """The momentum is judged from the poses of the bodies, so a mass that is one percent off shows."""

    @jax.jit
    def drifts(robot, tampered):
        motion = rollout(robot, problem.trajectory, problem.initial_state, num_steps=100)
        return momentum_drift(robot, motion), momentum_drift(tampered, motion)

    mass = np.array(robot.mass)
    mass[6] *= 1.01
    honest, tampered = drifts(robot, robot.replace(mass=mass))
    assert honest < 1e-6
    assert tampered > 1e-4
    verification = replace(plan.verification, momentum_drift=tampered)
    tolerances = replace(COARSE, momentum=Tolerances().momentum)
    assert result_code(problem, verification, np.array(True), tolerances) == ResultCode.NOT_VERIFIED


def test_planning_in_single_precision_is_refused(problem):
    with jax.enable_x64(False), pytest.raises(InputError, match="planning needs float64"):
        solve(problem, "qpso", SETTINGS)
