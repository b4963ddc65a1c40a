"""Result codes and their sentences, on verifications made by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from wu6_problems import limited, wu6_problem

from jffsr.clearance.along_motion import clearances
from jffsr.clearance.model import ClearanceModel
from jffsr.objectives.clearance import Clearance
from jffsr.objectives.composite import TermValue
from jffsr.objectives.torque_terms import JointTorque, TorqueLimit
from jffsr.planning.result import ResultCode, Tolerances, explain, result_code, torque_unseen
from jffsr.planning.verification import Overruns, Verification

TOLERANCES = Tolerances()
INSIDE = Overruns(np.full(6, -0.5), np.full(6, -0.1), np.full(6, -0.2), np.full(3, -0.3), np.full(6, -0.4))


@pytest.fixture(scope="module")
def problem(robots):
    return wu6_problem(limited(robots["wu_2018_6dof"]))


def verification(cost=0.5, overruns=INSIDE, **changes) -> Verification:
    numbers = {
        "attitude_difference": 1e-9,
        "position_difference": 1e-9,
        "boundary_error": 1e-15,
        "momentum_drift": 1e-10,
    }
    terms = {
        "attitude_change": TermValue(np.array(1e-4), np.array(0.1 * cost)),
        "joint_rate": TermValue(np.array(1e-3), np.array(0.9 * cost)),
    }
    numbers["measure"] = np.array(cost)
    return Verification(**(numbers | changes), cost=np.array(cost), terms=terms, overruns=overruns)


def judged(problem, checked, converged=True):
    code = result_code(problem, checked, jnp.array(converged), TOLERANCES)
    return explain(int(code), problem, checked, TOLERANCES)


def overrun(**changes) -> Overruns:
    return replace(INSIDE, **{kind: np.array(values) for kind, values in changes.items()})


def test_accuracy_met(problem):
    result = judged(problem, verification())
    assert result.code is ResultCode.ACCURACY_MET
    assert result.success
    assert result.sentence.startswith("accuracy met: J = 0.5 <= 1")


def test_accuracy_not_met_names_the_binding_term(problem):
    result = judged(problem, verification(cost=20.0))
    assert result.code is ResultCode.ACCURACY_NOT_MET
    assert not result.success
    assert "J = 20 > 1, bound by joint_rate (18 of J)" in result.sentence
    assert "every limit is kept" in result.sentence


def test_limits_of_torque_that_nobody_looked_at_are_not_said_to_be_kept(problem):
    robot = problem.robot.replace(limits=replace(problem.robot.limits, torque=np.full(6, 0.05)))
    bare = replace(problem, robot=robot)
    for checked in (verification(), verification(cost=20.0)):
        assert "every limit but those of torque is kept" in judged(bare, checked).sentence
    constraint = TorqueLimit(robot.limits.torque)
    held = replace(bare, constraints=(constraint,))
    kept = judged(held, verification(violations={constraint.name: np.array(0.0)})).sentence
    assert "every limit, and every constraint, is kept" in kept
    term = JointTorque(np.array(0.01), robot.limits.torque)
    objective = replace(problem.objective, terms=(*problem.objective.terms, term))
    assert torque_unseen(bare)
    assert not torque_unseen(replace(bare, objective=objective))


def test_not_converged_asks_for_a_larger_budget(problem):
    result = judged(problem, verification(cost=20.0), converged=False)
    assert result.code is ResultCode.NOT_CONVERGED
    assert "raise the budget" in result.sentence


def test_limits_violated_are_named_with_joint_and_amount(problem):
    rate = [-0.1, 0.052, -0.1, -0.1, 0.0005, -0.1]
    result = judged(problem, verification(overruns=overrun(rate=rate, excursion=[-0.1, -0.1, 0.25])))
    assert result.code is ResultCode.LIMITS_VIOLATED
    assert "rate of joint2 by 5.2 %" in result.sentence
    assert "base attitude excursion about z by 25 %" in result.sentence
    # Within the tolerance of 1e-3.
    assert "joint5" not in result.sentence


def test_every_kind_of_limit_counts(problem):
    for kind, size in (("position", 6), ("rate", 6), ("acceleration", 6), ("excursion", 3)):
        values = np.full(size, -0.1)
        values[1] = 2e-3
        result = judged(problem, verification(overruns=overrun(**{kind: values})))
        assert result.code is ResultCode.LIMITS_VIOLATED
        assert ("about y" if kind == "excursion" else f"{kind} of joint2") in result.sentence


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"attitude_difference": 2e-6}, "attitude difference of 2e-06 rad (allowed 1e-06)"),
        ({"momentum_drift": 3e-5}, "momentum drift of 3e-05 relative (allowed 1e-06)"),
        ({"boundary_error": 1e-3}, "boundary error of 0.001 (allowed 1e-08)"),
        ({"momentum_drift": np.nan}, "momentum drift of nan"),
    ],
)
def test_not_verified(problem, changes, words):
    for cost in (0.5, 50.0):
        result = judged(problem, verification(cost=cost, **changes))
        assert result.code is ResultCode.NOT_VERIFIED
        assert words in result.sentence
        assert "raise rollout.num_steps" in result.sentence


@pytest.mark.parametrize("cost", [np.nan, np.inf])
def test_not_finite(problem, cost):
    result = judged(problem, verification(cost=cost, attitude_difference=np.nan))
    assert result.code is ResultCode.NOT_FINITE
    assert "no finite index" in result.sentence


class Samples(NamedTuple):
    time: np.ndarray
    base_position: np.ndarray
    base_quaternion: np.ndarray
    joint_position: np.ndarray


def test_bodies_that_come_too_near_are_named_with_the_time(robots, problem):
    """The posture that comes nearest is the one of 6 s; without the motion the amount alone is known."""
    robot = robots["servicer_7dof"]
    model, joints = ClearanceModel.create(robot), np.random.default_rng(3).uniform(-2, 2, (7, 7))
    motion = Samples(np.linspace(0, 12, 7), np.zeros((7, 3)), np.tile([1.0, 0, 0, 0], (7, 1)), joints)
    least = clearances(model, robot, motion).min(axis=0)
    motion = motion._replace(joint_position=np.roll(joints, 3 - np.argmin(least), axis=0))
    constraint = Clearance(model, np.array(0.05))
    held = replace(problem, robot=robot, constraints=(constraint,))
    seven = {kind: np.full(7, -0.5) for kind in ("position", "rate", "acceleration", "torque")}
    checked = verification(overruns=overrun(**seven), violations={"clearance": np.array(0.3)})
    found = explain(ResultCode.CONSTRAINTS_VIOLATED, held, checked, TOLERANCES, motion).sentence
    names = " and ".join(model.pair_names[np.argmin(clearances(model, robot, motion)[:, 3])])
    assert f"clearance by 0.03 m (allowed 0.0001 m; at the planner's step {names} " in found
    assert "at 6 s, the margin is 0.05 m" in found
    # They are too near at the search's own samples, too: more steps alone would not help.
    assert "allow more time" in found
    lenient = replace(held, constraints=(replace(constraint, margin=np.array(-10.0)),))
    kept = explain(ResultCode.CONSTRAINTS_VIOLATED, lenient, checked, TOLERANCES, motion).sentence
    assert kept.endswith("the search had kept them at its own steps, so raise rollout.num_steps")
    plain = explain(ResultCode.CONSTRAINTS_VIOLATED, held, checked, TOLERANCES).sentence
    assert "clearance by 0.03 m (allowed 0.0001 m)" in plain


def test_codes_under_vmap_are_int32(problem):
    rows = [
        verification(),
        verification(cost=20.0),
        verification(overruns=overrun(rate=np.full(6, 0.1))),
        verification(cost=20.0),
        verification(attitude_difference=1.0),
        verification(cost=np.nan),
    ]
    batch = jax.tree.map(lambda *x: jnp.stack([jnp.asarray(y) for y in x]), *rows)
    converged = jnp.array([True, True, True, False, True, True])
    codes = jax.jit(jax.vmap(lambda v, c: result_code(problem, v, c, TOLERANCES)))(batch, converged)
    assert codes.dtype == jnp.int32
    np.testing.assert_array_equal(codes, np.arange(6))


def test_every_code_has_a_sentence(problem):
    sentences = {explain(code, problem, verification(), TOLERANCES).sentence for code in ResultCode}
    assert len(sentences) == len(ResultCode)
