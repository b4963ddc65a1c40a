"""Batches of plans in one compiled call, and plans as tables for other tools."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import chex
import jax
import numpy as np
import pytest
from planar_problems import SETTINGS, plan_in_chunks, planar, planar_problems
from scipy.io import loadmat
from virtual_devices import output_of
from wu6_problems import limited

from jffsr.errors import InputError
from jffsr.planning import many
from jffsr.planning.many import plan_many
from jffsr.planning.plan import solve
from jffsr.planning.result import ResultCode


@pytest.fixture(scope="module")
def problems(robots):
    return planar_problems(robots["hu_2011_planar2"])


@pytest.fixture(scope="module")
def plans(problems):
    many._plan_chunk.clear_cache()
    found = plan_in_chunks(problems, seed=3)
    assert many._plan_chunk._cache_size() == 1
    return found


def test_a_batch_is_planned_and_judged_like_single_plans(problems, plans):
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


@pytest.mark.slow
def test_plans_do_not_depend_on_the_devices(plans):
    """Three plans, two at a time, on four devices."""
    found = output_of(Path(__file__).parent / "plans_on_four_devices.py", devices=4)
    there = [np.array(numbers) for numbers in found["numbers"]]
    here = [plans.free, plans.cost, plans.motion.base_quaternion]
    chex.assert_trees_all_close(there, here, rtol=1e-12, atol=1e-12)
    assert found["programs"] == 1


@pytest.mark.parametrize("chunks_before_the_kill", [1, 2])
def test_a_killed_batch_goes_on_to_the_same_bits(
    chunks_before_the_kill, problems, plans, tmp_path, monkeypatch
):
    path, save, saved = tmp_path / "plans.npz", many.save_plans, []
    programs = many._plan_chunk._cache_size()

    def save_then_die(*arguments):
        save(*arguments)
        saved.append(path.stat().st_size)
        if len(saved) == chunks_before_the_kill:
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(many, "save_plans", save_then_die)
        with pytest.raises(KeyboardInterrupt):
            plan_in_chunks(problems, seed=3, checkpoint=path)
    chunks = []
    with monkeypatch.context() as patch:
        patch.setattr(many, "save_plans", lambda *arguments: chunks.append(save(*arguments)))
        again = plan_in_chunks(problems, seed=3, checkpoint=path)
    assert len(chunks) == 2 - chunks_before_the_kill
    chex.assert_trees_all_equal(again, plans)
    assert many._plan_chunk._cache_size() == programs


def test_a_checkpoint_of_others_is_refused(problems, plans, tmp_path, robots):
    path = tmp_path / "plans.npz"
    plan_in_chunks(problems, seed=3, checkpoint=path)
    other = planar(limited(robots["hu_2011_planar2"]), 20.5)
    for arguments in ({"seed": 4}, {"problems": [other, *problems[1:]]}):
        with pytest.raises(InputError, match="is of other problems"):
            plan_in_chunks(**{"problems": problems, "seed": 3, "checkpoint": path, **arguments})
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(InputError, match="cannot be read"):
        plan_in_chunks(problems, seed=3, checkpoint=path)
    with pytest.raises(InputError, match="chunk is 0"):
        plan_many(problems, chunk=0)


def test_problems_of_other_structure_are_refused(problems, robots):
    other = planar(limited(robots["hu_2011_planar2"]), 20.0, excursion_limit=None)
    with pytest.raises(InputError, match="problem 3 differs from problem 0"):
        plan_many([*problems, other], "qpso", SETTINGS)
    with pytest.raises(InputError, match="no problem"):
        plan_many([])


@pytest.mark.slow
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


def test_seeds_and_settings_of_their_own_are_those_of_single_plans(problems):
    """Wherever a problem stands, and beside whichever others."""
    sets = [replace(SETTINGS, contraction=(start, 0.5)) for start in (1.0, 0.8, 0.6)]
    seeds = [7, 5, 7]
    plans = plan_many(problems, "qpso", sets, seeds=seeds, with_history=True)
    for i in range(3):
        plan = solve(problems[i], "qpso", sets[i], seed=seeds[i], with_sensitivity=False)
        np.testing.assert_allclose(plans.cost[i], plan.cost, rtol=1e-9)
        np.testing.assert_allclose(
            plans.history.best_value[i], [r.best_value for r in plan.history], rtol=1e-9
        )
        np.testing.assert_array_equal(plans.history.evaluations[i], [r.evaluations for r in plan.history])
    again = plan_many(problems[::-1], "qpso", sets[::-1], seeds=seeds[::-1], with_history=True)
    chex.assert_trees_all_close(again.cost[::-1], plans.cost, rtol=1e-9)


def test_seeds_and_settings_that_do_not_fit_are_refused(problems):
    for other in (replace(SETTINGS, particles=5), replace(SETTINGS, evaluations=60)):
        with pytest.raises(InputError, match="settings 1 differ from settings 0"):
            plan_many(problems, "qpso", [SETTINGS, other, SETTINGS])
    with pytest.raises(InputError, match="2 settings were given for 3 problems"):
        plan_many(problems, "qpso", [SETTINGS] * 2)
    with pytest.raises(InputError, match="2 seeds were given for 3 problems"):
        plan_many(problems, "qpso", SETTINGS, seeds=[1, 2])
