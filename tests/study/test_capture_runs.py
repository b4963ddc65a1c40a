"""Capture studies in run folders: what a folder holds, statuses, figures, MuJoCo; known and observed targets."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

import jffsr
from jffsr import cli
from jffsr.study.capture import running
from jffsr.study.capture.building import build_study
from jffsr.study.config import load_config
from jffsr.study.dataset import open_dataset
from jffsr.target.grasp_frames import grasp_frame

CONFIG = """\
kind: capture
robot: ye_2019_planar3
task: {start_deg: [60, -120, 60]}
target:
  inertia: [1, 1, 1.5]
  position: [3.3, 0.1, 0]
  angular_velocity_deg: [0, 0, 1]
  grasps: {handle: {position: [-0.3, 0, 0]}}
  shapes: [{type: box, size: [0.15, 0.15, 0.15]}]
grasp_time: {window: [10, 30]}
planner: {margin: null, times: 2, starts: 2, postures: 1, lanes: 2, num_steps: 20, improve: 0}
output: {figures: false, progress: false}
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    """A planar arm and a box that turns before it."""
    file = tmp_path_factory.mktemp("capture") / "planar.yaml"
    file.write_text(CONFIG)
    return file


def run(config, folder, *overrides: str) -> int:
    return cli.main(["run", str(config), *overrides, "--out", str(folder)])


def summary_of(folder) -> dict:
    return json.loads((folder / "summary.json").read_text())


@pytest.fixture(scope="module")
def away(config, tmp_path_factory):
    """A handle that looks away all the time."""
    folder = tmp_path_factory.mktemp("runs") / "away"
    assert run(config, folder, "target.grasps.handle.rotation_vector_deg=[0, 0, 180]") == cli.NOT_MET
    return folder


def test_a_handle_that_looks_away_is_no_success(away, capsys):
    assert {path.name for path in away.iterdir()} == {
        "config.yaml",
        "summary.json",
        "result.nc",
        "metrics.jsonl",
    }
    summary = summary_of(away)
    assert summary["kind"] == "capture"
    assert (summary["result"]["code"], summary["result"]["name"]) == (1, "never_facing")
    assert "never facing: between 10 and 30 s" in summary["result"]["sentence"]
    assert summary["grasp_time"]["name"] == "never_facing"
    assert summary["cost"] is None
    assert set(summary["seconds"]) == {"compile", "run", "total"}
    dataset = open_dataset(away / "result.nc")
    assert dataset["criterion"].dims == ("grasp", "scan_time")
    assert dataset["criterion"].attrs["units"] == "m"
    assert not dataset["grasp_feasible"].any()
    assert "joint_position" not in dataset
    # Shown, its criterion is drawn; in MuJoCo there is nothing to be made again.
    assert cli.main(["show", str(away), "--report"]) == cli.MET
    assert "never facing" in capsys.readouterr().out
    assert "nothing moves in it" in (away / "report.html").read_text(encoding="utf-8")
    assert cli.main(["show", str(away), "--html"]) == cli.BAD_INPUT
    assert "nothing moves in it" in capsys.readouterr().err
    assert {path.name for path in (away / "figures").iterdir()} == {"grasp_time.png", "grasp_time.pdf"}
    assert cli.main(["check", str(away)]) == cli.BAD_INPUT
    assert "the run found no plan" in capsys.readouterr().err


def test_a_finished_run_is_told_and_another_refused(config, away, capsys):
    same = "target.grasps.handle.rotation_vector_deg=[0, 0, 180]"
    assert run(config, away, same) == cli.NOT_MET
    assert "is finished" in capsys.readouterr().out
    assert run(config, away, same, "seed=3") == cli.BAD_INPUT
    assert "holds a run of another configuration" in capsys.readouterr().err


def test_a_run_that_is_stopped_begins_anew(config, tmp_path, monkeypatch, capsys):
    def stop(*_):
        raise KeyboardInterrupt

    away = "target.grasps.handle.rotation_vector_deg=[0, 0, 180]"
    with monkeypatch.context() as patch:
        patch.setattr(running, "plan_study", stop)
        assert run(config, tmp_path / "stopped", away) == cli.INTERRUPTED
    assert "interrupted" in capsys.readouterr().err
    assert {path.name for path in (tmp_path / "stopped").iterdir()} == {"config.yaml"}
    assert run(config, tmp_path / "stopped", away) == cli.NOT_MET


def test_a_grasp_point_inside_the_body_is_told(config, tmp_path):
    inside = ["target.grasps.handle.position=[-0.1, 0, 0]", "target.position=[3.1, 0.1, 0]"]
    assert run(config, tmp_path / "inside", *inside) == cli.NOT_MET
    assert summary_of(tmp_path / "inside")["result"]["name"] == "grasp_inside_body"


def captured_by(config, folder, *overrides: str):
    """The folder of a capture run in a process of its own, so that it has all cores, as a user's has."""
    command = [sys.executable, "-m", "jffsr.cli", "run", str(config), *overrides, "--out", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
    assert done.returncode == cli.MET, done.stdout + done.stderr
    assert "captured: pose and velocity match" in done.stdout
    return folder


@pytest.fixture(scope="module")
def captured(config, tmp_path_factory):
    return captured_by(config, tmp_path_factory.mktemp("runs") / "captured")


@pytest.mark.slow
def test_a_captured_target_is_where_the_tool_is(captured):
    summary, dataset = summary_of(captured), open_dataset(captured / "result.nc")
    assert summary["result"]["name"] == "captured"
    assert max(summary["grasp_error"].values()) < 1e-6
    assert 10 <= summary["duration"] <= 30
    assert summary["attempts"] >= 1
    assert summary["evaluations"]["gradient"] >= summary["attempts"]
    assert summary["terms"]["base_disturbance"]["value"] > 0
    # The last posture, by kinematics alone, and the handle, by the target's motion alone.
    study = build_study(load_config(captured / "config.yaml"))
    last = dataset.isel(time=-1)
    state = jffsr.State(
        last["base_position"].to_numpy(),
        last["base_quaternion"].to_numpy(),
        last["joint_position"].to_numpy(),
    )
    tool, _ = jffsr.end_effector_pose(study.robot, jffsr.kinematics(study.robot, state))
    handle, _, twist = grasp_frame(study.target, study.motion(summary["duration"]))
    np.testing.assert_allclose(tool, handle, atol=1e-6)
    np.testing.assert_allclose(last["tool_twist"], twist, atol=1e-6)
    np.testing.assert_allclose(last["grasp_position"], handle, atol=1e-12)
    # Along the way the tool's velocity is the derivative of its place.
    place, time = dataset["tool_position"].to_numpy(), dataset["time"].to_numpy()
    slope = (place[2:] - place[:-2]) / (time[2:] - time[:-2])[:, None]
    np.testing.assert_allclose(dataset["tool_twist"][1:-1, :3], slope, atol=2e-3)


@pytest.mark.slow
def test_the_capture_is_made_again_in_mujoco_and_drawn(captured, capsys):
    assert cli.main(["check", str(captured)]) == cli.MET
    assert "nothing touched" in capsys.readouterr().out
    kept = summary_of(captured)["verification"]["mujoco"]
    assert kept["passed"]
    assert kept["tool_position"] < 1e-7
    assert cli.main(["show", str(captured)]) == cli.MET
    assert "simulators    MuJoCo, with contacts on" in capsys.readouterr().out
    drawn = {path.name for path in (captured / "figures").iterdir()}
    assert {"capture.png", "tool.pdf", "joints.png", "base.png", "grasp_time.png"} <= drawn


@pytest.mark.slow
def test_an_estimate_that_has_not_converged_is_no_ground_for_a_plan(config, tmp_path):
    seen = "observation={duration: 4, acquisition: 30}"
    assert run(config, tmp_path / "seen", seen) == cli.NOT_MET
    summary = summary_of(tmp_path / "seen")
    assert summary["result"]["name"] == "estimate_not_converged"
    observed = summary["observation"]
    assert (observed["exposures"], observed["converged"], observed["lost"]) == (41, False, False)
    assert 30 <= observed["seen"] <= 41
    # Off by no more than five times what the covariance says.
    for name, deviation in observed["predicted_deviation"].items():
        assert observed["prediction_error"][name] < 5 * deviation
    assert summary["duration"] is None


@pytest.mark.slow
def test_an_observed_target_is_met_as_well_as_it_is_known(config, captured, tmp_path):
    """A good camera, and a match loose enough for an arm that cannot leave its plane."""
    seen = "observation={duration: 4, acquisition: 30, camera: {noise: 0.02}}"
    turned = "target.marker={position: [0.02, -0.01, 0], rotation_vector_deg: [0, 0, 70]}"
    folder = captured_by(config, tmp_path / "seen", seen, turned, "planner.tolerance=0.02")
    summary, dataset = summary_of(folder), open_dataset(folder / "result.nc")
    observed = summary["observation"]
    assert observed["converged"]
    # The tool is within the match's tolerance of the prediction, and that within its deviations of the truth.
    for name, deviation in observed["predicted_deviation"].items():
        assert summary["grasp_error"][name] < 0.02
        assert observed["prediction_error"][name] < 5 * deviation
        most = summary["grasp_error"][name] + observed["prediction_error"][name]
        assert observed["error_to_true_target"][name] < 1.01 * most
    # The target is told where it really is, its axes those of its shapes; not where it is thought to be.
    study = build_study(load_config(folder / "config.yaml"))
    end = study.motion(summary["duration"])
    np.testing.assert_allclose(dataset["target_position"][-1], end.position, atol=1e-12)
    np.testing.assert_allclose(dataset["target_quaternion"][-1], end.quaternion, atol=1e-12)
    error = dataset["true_grasp_error"].to_numpy()[-1]
    assert np.linalg.norm(error[:3]) == pytest.approx(observed["error_to_true_target"]["position_m"])
    np.testing.assert_allclose(
        dataset["tool_position"][-1] - dataset["true_grasp_position"][-1], error[:3], atol=1e-12
    )
    assert cli.main(["show", str(folder)]) == cli.MET
    assert cli.main(["check", str(folder)]) == cli.MET
