"""Tracking studies in run folders: what a folder holds, statuses, figures, and a tuning that is stopped and goes on."""

from __future__ import annotations

import json

import numpy as np
import pytest

from jffsr import cli
from jffsr.study import searching
from jffsr.study.config import load_config
from jffsr.study.dataset import open_dataset
from jffsr.study.tracking.building import build_task
from jffsr.study.tracking.summary import summary_text
from jffsr.viz.showing import write_page, write_report

CONFIG = "wu_2018"
# A short stretch of the way, 8 samples.
SHORT = [
    "path.poses=[{position: [1.37, -0.08, 0.64], angles: [-3.14, 0, -2.97]}, "
    "{position: [1.39, -0.07, 0.6], angles: [-3.14, -0.01, -2.99]}]",
    "timing.duration=2",
    "compare=null",
    "tracker.feedforward=mean",
    "verification.singularities=false",
    "output.figures=false",
    "output.progress=false",
]
TWO = "compare={weak: {epsilon: 0.01}, strong: {lambda_max: 2.0, epsilon: 3.0}}"


def run(folder, *overrides: str) -> int:
    return cli.main(["run", CONFIG, *SHORT, *overrides, "--out", str(folder)])


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """Two trackers compared on the short stretch."""
    folder = tmp_path_factory.mktemp("tracking") / "compared"
    assert run(folder, TWO) == cli.MET
    return folder


def test_folder_holds_what_is_promised(compared):
    assert {path.name for path in compared.iterdir()} == {"config.yaml", "summary.json", "result.nc"}
    summary = json.loads((compared / "summary.json").read_text())
    assert summary["kind"] == "tracking"
    assert summary["result"] == {"code": 0, "name": "compared", "sentence": "2 trackers compared on one path"}
    assert set(summary["trackers"]) == {"weak", "strong"}
    assert set(summary["seconds"]) == {"compile", "run", "total"}
    assert summary["versions"]["jax"]
    weak, strong = (summary["trackers"][label] for label in ("weak", "strong"))
    # No singularity is near: the weak damping is none, the strong one loses the path.
    assert weak["pose_errors"]["position_peak"] < 1e-3 < strong["pose_errors"]["position_peak"]
    assert weak["verification"]["momentum_drift"] < 1e-8
    assert weak["verification"]["tool_position_difference"] < 1e-9


def test_result_is_labelled_and_consistent(compared):
    dataset = open_dataset(compared / "result.nc")
    assert dataset["tool_position"].dims == ("tracker", "time", "axis")
    assert list(dataset["tracker"].to_numpy()) == ["weak", "strong"]
    assert dataset["pose_error"].attrs["units"] == "m, rad"
    np.testing.assert_allclose(
        dataset["pose_error"][..., :3],
        dataset["tool_position"] - dataset["target_position"].to_numpy(),
        atol=1e-15,
    )
    # Rates are held from each sample to the next.
    moved = np.diff(dataset["joint_position"].to_numpy(), axis=1) / 0.25
    np.testing.assert_allclose(moved, dataset["joint_velocity"].to_numpy()[:, :-1], atol=1e-12)
    task = build_task(load_config(compared / "config.yaml"))
    end = task.target(2.0)
    np.testing.assert_allclose(dataset["target_position"][0, -1], end.position, atol=1e-15)


def test_a_finished_run_is_told_and_shared(compared, tmp_path, capsys):
    before = (compared / "summary.json").read_bytes()
    assert run(compared, TWO) == cli.MET
    assert "is finished" in capsys.readouterr().out
    assert (compared / "summary.json").read_bytes() == before
    pages = (
        write_page([compared], tmp_path / "replay.html"),
        write_report(compared, (), tmp_path / "report.html"),
    )
    for page in pages:
        text = page.read_text(encoding="utf-8")
        assert len(text) < 3e6
        assert '<option value="1">' in text  # the plots of each tracker
    assert "the way that was asked of the tool" in text


@pytest.mark.slow
def test_a_finished_run_is_shown(compared, capsys):
    assert cli.main(["show", str(compared)]) == cli.MET
    assert "weak" in capsys.readouterr().out
    figures = {path.name for path in (compared / "figures").iterdir()}
    assert {"tool_path.png", "pose_errors.pdf", "singular_values.png", "tracked_joints.png"} <= figures


def test_the_motion_is_made_again_in_mujoco(compared, capsys):
    assert cli.main(["check", str(compared)]) == cli.MET
    assert "MuJoCo reproduces the tracked motion" in capsys.readouterr().out
    kept = json.loads((compared / "summary.json").read_text())
    assert kept["verification"]["mujoco"]["passed"]
    assert "simulators    MuJoCo reproduces" in summary_text(kept)


def test_accuracy_that_is_asked_for_decides(tmp_path, capsys):
    """One tracker: the path is lost by the strong damping, and kept too fast by the weak one."""
    alone = ["accuracy.position=0.001"]
    assert run(tmp_path / "lost", *alone, "tracker.lambda_max=2", "tracker.epsilon=3") == cli.NOT_MET
    assert "the path was lost" in capsys.readouterr().out
    assert run(tmp_path / "fast", *alone, "tracker.epsilon=0.01", "accuracy.rate_deg=0.5") == cli.NOT_MET
    assert "accuracy.rate_deg asks for 0.5 deg/s" in capsys.readouterr().out


def test_a_path_through_the_base_is_no_success(tmp_path, capsys):
    through = [
        "path.poses.1={position: [0, 0, 0], angles: [-3.14, 0, -2.97]}",
        "timing.duration=2",
        "tracker.lambda_max=1",
        "tracker.epsilon=3",
    ]
    for extra in ((), ("compare={one: {}, two: {lambda_max: 2}}",)):
        folder = tmp_path / str(len(extra))
        assert run(folder, *through, *extra) == cli.NOT_MET
        assert "the path leads through the base's body" in capsys.readouterr().out


@pytest.mark.slow
def test_a_tuning_goes_on_to_the_same_bits_where_it_was_stopped(tmp_path, capsys, monkeypatch):
    asked = (
        "tuning={parameters: {lambda_max: [0.001, 1], epsilon: [0.01, 3]}, index: path_error, rate_limit_deg: 6}",
        "tuning.optimizer.kind=ga_binary",
        "tuning.optimizer.particles=6",
        "tuning.optimizer.evaluations=36",
        "tuning.optimizer.chunk=2",
    )
    assert run(tmp_path / "whole", *asked) == cli.MET
    assert "tuned         index" in capsys.readouterr().out

    class Second(searching.Interrupt):
        asked = 0

        def __call__(self):
            Second.asked += 1
            return Second.asked == 2

    with monkeypatch.context() as patch:
        patch.setattr(searching, "Interrupt", Second)
        assert run(tmp_path / "stopped", *asked) == cli.INTERRUPTED
    assert (tmp_path / "stopped" / "checkpoint.npz").is_file()
    assert run(tmp_path / "stopped", *asked) == cli.MET
    assert "going on from" in capsys.readouterr().out
    whole, stopped = (
        json.loads((tmp_path / name / "summary.json").read_text()) for name in ("whole", "stopped")
    )
    assert stopped["trackers"] == whole["trackers"]
    assert stopped["cost"] == whole["cost"]
    assert set(whole["trackers"]) == {"adaptive", "tuned"}
    assert whole["evaluations"]["objective"] == 36
