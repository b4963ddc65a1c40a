"""Reactionless studies in run folders: the published numbers, runs that are compared, refusals in one sentence."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import jffsr
from jffsr import cli
from jffsr.study.config import dump_config, load_config
from jffsr.study.dataset import open_dataset
from jffsr.study.lookup import find_config
from jffsr.viz.run import draw_run

CONFIG = """\
kind: reactionless
robot: ye_2019_planar3
task: {start: [0, 0, 0]}
load: {mass: 5, inertia: [2.5, 2.5, 2.5], position: [0.1, 0, 0], angular_velocity: [0, 0, 0.5]}
hold:
  {duration: 2, settled: 0.2, rate: 100, controller: computed_torque, estimator: known, base_rate: 0.1,
   gains: {rate: 60, position: 8}, excitation: {amplitude: 0}}
output: {figures: false, progress: false}
"""


STRIKE = 1.6


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    file = tmp_path_factory.mktemp("reactionless") / "published.yaml"
    file.write_text(CONFIG)
    return file


@pytest.fixture(scope="module")
def finished(config, tmp_path_factory):
    """Two runs of the published case, with a blow in both."""
    folder = tmp_path_factory.mktemp("runs") / "published"
    arguments = ["runs={known: {}, fast: {controller: computed_torque}}", "seeds=2", f"strike.time={STRIKE}"]
    status = cli.main(["run", str(config), *arguments, "hold.sensors.gyro=1e-4", "--out", str(folder)])
    return folder, status


def test_folder_holds_every_run_and_seed(finished):
    folder, status = finished
    summary = json.loads((folder / "summary.json").read_text())
    assert status == cli.MET
    assert summary["result"]["sentence"].startswith("The base is held still by 2 of 2 runs")
    assert list(summary["runs"]) == ["known", "fast"]
    assert summary["contact"]["base_rate"] == pytest.approx(0.00582, abs=5e-6)
    dataset = open_dataset(folder / "result.nc")
    assert dict(dataset.sizes) == {
        "run": 2, "seed": 2, "time": 201, "joint": 3, "axis": 3, "component": 4, "twist": 6
    }  # fmt: skip
    assert len((folder / "metrics.jsonl").read_text().splitlines()) == 2
    # Of the same seed and controller, and so the same.
    np.testing.assert_array_equal(*dataset["joint_position"].values)
    rates = dataset["settled_base_rate"].values
    assert summary["runs"]["known"]["base_rate"] == pytest.approx(np.median(rates[0]))
    assert rates[0, 0] != rates[0, 1]


def test_momentum_is_the_targets_until_the_pendulum_strikes(finished):
    dataset = open_dataset(finished[0] / "result.nc")
    angular = dataset["momentum"].values[0, :, 5]
    before = dataset["time"].values <= STRIKE
    np.testing.assert_allclose(angular[before], 2.5 * 0.5, atol=1e-6)
    # m (v_0 - v_t) sin(30 deg) 0.1 m, of a block of 5 kg on a rope of 0.2 m from 10 deg, and up to 3.8 deg again.
    speeds = [math.sqrt(2 * 9.8 * 0.2 * (1 - math.cos(math.radians(a)))) for a in (10.0, 3.8)]
    impulse = 5 * (speeds[0] - speeds[1]) * 0.5 * 0.1
    np.testing.assert_allclose(angular[~before], 1.25 + impulse, atol=1e-6)


def test_the_base_is_held_with_the_known_load(finished):
    dataset = open_dataset(finished[0] / "result.nc").isel(run=0)
    spin = np.linalg.norm(dataset["base_twist"].values[:, 3:], axis=1)
    time = dataset["time"].values
    assert spin[0] == pytest.approx(0.00582, abs=5e-6)
    assert spin[(time > 1.2) & (time <= STRIKE)].max() < 5e-4
    before = spin[time <= STRIKE][-1]
    assert spin[time > STRIKE].max() > before + 3e-4


def test_figures_are_drawn(finished):
    folder, _ = finished
    draw_run(folder, ["png"])
    for name in ("base", "tracking", "momentum", "hold_known", "hold_fast"):
        assert (folder / "figures" / f"{name}.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_page_has_every_run(finished):
    folder, _ = finished
    assert cli.main(["show", "--html", str(folder), "--no-serve"]) == cli.MET
    page = (folder / "replay.html").read_text(encoding="utf-8")
    assert ">known</option>" in page
    assert ">fast</option>" in page


def test_shipped_configuration_reads_back_as_it_is(tmp_path):
    config = load_config("ye_2019")
    copy = tmp_path / "copy.yaml"
    copy.write_text(dump_config(config))
    assert load_config(copy) == config
    assert find_config("ye_2019").parent.name == "reactionless"
    assert config.load.mass == 5


@pytest.mark.parametrize(
    ("override", "sentence"),
    [
        ("hold.estimator=plian", "found 'plian'.*'plain'"),
        ("hold.controller=pid", "found 'pid'"),
        ("hold.gains.rate=[1, 2]", "hold: run 'published'.gains.rate: found a list of 2.*3 joints"),
        ("hold.gains.position=0", "hold.gains.position: found 0, a number > 0"),
        ("hold.settled=3", "hold.settled: found 3 s, at most the duration"),
        ("load.mass=-1", "load.mass: found -1"),
        ("load.inertia=[1, 1, 3]", "load.inertia:"),
        ("load.quaternion=[2, 0, 0, 0]", "load.quaternion: found .* of length 2"),
        ("task.base_mode=fixed", "task.base_mode: found 'fixed'"),
        ("strike.time=3", "strike.time: found 3 s, less than the hold's 2 s"),
        ("strike={time: 0.1, rebound_deg: 20}", "strike.rebound_deg: found 20, less than"),
        ("runs={a: {estimater: plain}}", "estimater.*estimator"),
        ("hold.excitation.slowest=1", "hold.excitation.slowest: found 1 Hz, less than"),
        ("robot=hu_2011_planar2", "found a list of 3.*2 joints"),
    ],
)
def test_bad_input_is_told_in_one_sentence(config, override, sentence, tmp_path, capsys):
    status = cli.main(["run", str(config), override, "--out", str(tmp_path / "run")])
    said = capsys.readouterr().err
    assert status == cli.BAD_INPUT
    assert said.count("\n") == 1
    assert not (tmp_path / "run").exists()
    with pytest.raises(jffsr.InputError, match=sentence):
        raise jffsr.InputError(said)


@pytest.mark.slow
def test_mujoco_moves_the_robot_as_the_study_says(finished, capsys):
    folder, _ = finished
    assert cli.main(["check", str(folder)]) == cli.MET
    assert "says the same of every run" in capsys.readouterr().out
    found = json.loads((folder / "summary.json").read_text())["verification"]["mujoco"]
    assert found["passed"]
    for run in found["runs"].values():
        assert 0 < run["attitude"] < 1e-5
        assert run["momentum"] < 1e-3
