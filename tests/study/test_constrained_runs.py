"""A study with constraints from its file to its folder, and a batch of constrained plans."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest

from jffsr import cli
from jffsr.errors import InputError
from jffsr.objectives.constraints import FinalAttitude
from jffsr.optimizers.constraints import Feasible
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.planning.many import plan_many
from jffsr.planning.result import ResultCode, Tolerances, explain, result_code
from jffsr.planning.search import search_of
from jffsr.study.building import build_problem
from jffsr.study.config import load_config
from jffsr.study.dataset import open_dataset
from jffsr.study.planning import run_planning
from jffsr.study.summary import summary_text
from jffsr.study.sweep.misses import misses_of

CONFIG = """\
kind: planning
name: constrained
robot: hu_2011_planar2
task: {start_deg: [90, 30], goal_deg: [-60, 90], duration: 60}
limits: {position_deg: 324, rate: 0.25, acceleration: 0.2, base_excursion_deg: 40}
objective: {attitude_change: {enabled: false}}
constraints:
  final_attitude: {angle_deg: 30, tolerance: 1e-5}
  joint_limits: {}
rollout: {num_steps: 24}
optimizer: {kind: gradient, starts: 3, gradient_iterations: 60, polish_iterations: 40,
            memory: 4, chunk: 4}
verification: {step_factor: 2, sensitivity: false, attitude_tolerance: 1e-4, momentum_tolerance: 1e-3}
output: {figures: false, progress: false}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    path = tmp_path_factory.mktemp("constrained") / "constrained.yaml"
    path.write_text(CONFIG)
    return load_config(str(path))


@pytest.fixture(scope="module")
def finished(config, tmp_path_factory):
    """The run's folder and its summary."""
    folder = tmp_path_factory.mktemp("constrained") / "run"
    found = run_planning(config, folder)
    return folder, found.summary


def final_angle(folder: Path) -> float:
    """Of the base about z, rad, from the written quaternion alone."""
    w, _, _, z = open_dataset(folder / "result.nc")["base_quaternion"].values[-1]
    return 2 * np.arctan2(z, w)


def test_the_folder_shows_what_was_kept(finished, config):
    folder, summary = finished
    assert abs(final_angle(folder) - np.deg2rad(30)) <= 1e-5
    shown = summary["verification"]["constraints"]
    assert set(shown) == {"final_attitude", "joint_limits"}
    assert shown["final_attitude"]["tolerance"] == 1e-5
    assert 0 < shown["final_attitude"]["violation"] < 1e-3
    text = summary_text(summary)
    assert "constraint    final_attitude missed by" in text
    assert "(allowed 0.001)" in text
    kept = all(one["violation"] <= one["tolerance"] for one in shown.values())
    assert summary["result"]["name"] == ("accuracy_met" if kept else "constraints_violated")
    # The index is the published one, no merit.
    assert summary["cost"] == pytest.approx(sum(t["weighted"] for t in summary["terms"].values()), abs=1e-12)
    assert 0 <= summary["cost"] < 1e6


def test_metrics_and_history_tell_index_and_violation_apart(finished):
    folder, _ = finished
    rows = [json.loads(line) for line in (folder / "metrics.jsonl").read_text().splitlines()]
    assert rows[0]["best_value"] is None
    assert rows[0]["violation"] > 1e-3
    assert rows[-1]["violation"] == 0
    assert rows[-1]["best_value"] < 1e6
    assert {row["phase"] for row in rows} == {"constrained"}
    dataset = open_dataset(folder / "result.nc")
    violation, best = dataset["history_violation"].values, dataset["history_best_value"].values
    np.testing.assert_array_equal(np.isinf(best), violation > 0)
    assert violation[-1] == 0


def test_an_interrupted_run_goes_on_to_the_same_bits(finished, config, tmp_path, monkeypatch):
    from jffsr.study import searching

    folder, _ = finished
    stopped = []

    class After(searching.Interrupt):
        def __call__(self):
            stopped.append(1)
            return len(stopped) == 6

    with monkeypatch.context() as patch:
        patch.setattr(searching, "Interrupt", After)
        assert run_planning(config, tmp_path / "run").interrupted
    assert len((tmp_path / "run" / "metrics.jsonl").read_text().splitlines()) == 5
    run_planning(config, tmp_path / "run")
    for name in ("metrics.jsonl",):
        assert (tmp_path / "run" / name).read_bytes() == (folder / name).read_bytes()
    np.testing.assert_array_equal(
        open_dataset(tmp_path / "run" / "result.nc")["free_numbers"],
        open_dataset(folder / "result.nc")["free_numbers"],
    )


def test_command_line_prints_the_constraints(finished, capsys):
    folder, summary = finished
    status = cli.main(["run", str(folder / "config.yaml"), "--out", str(folder)])
    said = capsys.readouterr()
    assert status == (cli.MET if summary["result"]["code"] == 0 else cli.NOT_MET)
    assert "joint_limits missed by" in said.out + said.err


def test_without_constraints_nothing_changes(config):
    problem = replace(build_problem(config), constraints=())
    settings = Settings()
    phases, searched = search_of(problem, "hybrid", settings)
    assert searched is problem
    assert phases == build_phases("hybrid", settings)
    assert "history_violation" not in vars(problem)


def test_two_constraints_of_one_name_are_refused(config):
    problem = build_problem(config)
    problem = replace(problem, constraints=problem.constraints * 2)
    with pytest.raises(InputError, match="two constraints are named 'final_attitude'"):
        search_of(problem, "hybrid", Settings())


@pytest.mark.slow
def test_a_batch_is_planned_under_its_own_constraints(config):
    """Three final attitudes of one task in one program; the last cannot be reached."""
    problem = build_problem(config)
    goals = np.deg2rad([30.0, 50.0, -170.0])
    problems = [
        replace(
            problem,
            constraints=(FinalAttitude(np.array([np.cos(a / 2), 0, 0, np.sin(a / 2)]), np.array(1e-4)),),
        )
        for a in goals
    ]
    settings = Settings(starts=1, gradient_iterations=80, polish_iterations=40, memory=4)
    plans = plan_many(
        problems, "gradient", settings, step_factor=2, tolerances=Tolerances(attitude=1e-3, momentum=1e-2)
    )
    w, z = plans.motion.base_quaternion[:, -1, 0], plans.motion.base_quaternion[:, -1, 3]
    angles = 2 * np.arctan2(z, w)
    np.testing.assert_allclose(angles[:2], goals[:2], atol=1e-4)
    assert np.abs(angles[2] - goals[2]) > 0.5
    assert plans.result[2] == ResultCode.CONSTRAINTS_VIOLATED
    missed = plans.verification.violations["final_attitude"]
    assert missed[2] > 0.5
    told = misses_of(problems, plans.verification.violations)
    off = np.abs(np.angle(np.exp(1j * (angles - goals))))
    np.testing.assert_allclose(told["constraint_missed"][:, 0], off, atol=1e-3)
    assert told["constraint_units"].tolist() == ["rad"]
    assert np.all(plans.cost < 1e6)
    for i, single in enumerate(problems):
        found = Feasible(single).evaluation(plans.free[i])
        np.testing.assert_allclose(found.value, plans.cost[i], rtol=1e-9, atol=1e-12)
        checked = jax.tree.map(lambda leaf, i=i: leaf[i], plans.verification)
        code = result_code(single, checked, np.array(True), Tolerances(attitude=1e-3, momentum=1e-2))
        assert code == plans.result[i]
    sentence = explain(plans.result[2], problems[2], checked, Tolerances()).sentence
    assert sentence.startswith("constraints violated on the finer grid: final_attitude by ")
    assert "(allowed 0.0001 rad)" in sentence
