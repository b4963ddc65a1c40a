"""Studies in run folders: what a folder holds, repeating, resuming, and refusing."""

from __future__ import annotations

import errno
import html
import json
import os
import shutil
import signal
import subprocess
import sys

import chex
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jffsr import cli
from jffsr.study import planning, searching
from jffsr.study.dataset import open_dataset
from jffsr.study.summary import summary_text
from jffsr.viz.showing import write_page, write_report

CONFIG = "configs/planning/composite_wu6.yaml"


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    status = cli.main(["run", *arguments])
    said = capsys.readouterr()
    return status, said.out, said.err


@pytest.fixture(scope="module")
def finished(tmp_path_factory, small):
    """A small finished run."""
    folder = tmp_path_factory.mktemp("runs") / "finished"
    overrides = [*small, "verification.sensitivity=true"]
    assert cli.main(["run", CONFIG, *overrides, "--out", str(folder)]) == cli.NOT_MET
    return folder


def test_folder_holds_what_is_promised(finished):
    names = {path.name for path in finished.iterdir()}
    assert names == {"config.yaml", "summary.json", "result.nc", "metrics.jsonl"}
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["kind"] == "planning"
    assert summary["result"]["code"] in range(1, 6)
    assert summary["result"]["sentence"]
    assert set(summary["terms"]) == {
        "attitude_change",
        "joint_rate",
        "joint_acceleration",
        "attitude_excursion",
    }
    assert sum(term["weighted"] for term in summary["terms"].values()) == pytest.approx(
        summary["cost"], rel=1e-9
    )
    assert set(summary["seconds"]) == {"compile", "run", "total"}
    assert summary["evaluations"]["objective"] == 16
    assert 1 <= summary["evaluations"]["gradient"] <= 6
    assert {"attitude_difference_rad", "momentum_drift_relative"} <= set(summary["verification"])
    sensitivity = summary["sensitivity"]
    assert set(sensitivity["bodies"]) == {row["body"] for row in sensitivity["per_percent"]}
    assert len(sensitivity["per_percent"]) == 2 * 7
    text = summary_text(summary)
    assert sensitivity["per_percent"][0]["sentence"] in text
    assert "clearance     whether bodies touch was not looked at" in text
    assert summary["terms"]["attitude_change"]["unit"] == "rad"
    assert summary["versions"]["jax"]
    lines = [json.loads(line) for line in (finished / "metrics.jsonl").read_text().splitlines()]
    assert lines[0]["phase"] == "swarm"
    assert lines[-1]["best_value"] == summary["cost"]


def test_a_run_is_shared_in_one_file(finished, tmp_path):
    replay = write_page([finished, finished], tmp_path / "replay.html").read_text(encoding="utf-8")
    report = write_report(finished, (), tmp_path / "report.html").read_text(encoding="utf-8")
    summary = json.loads((finished / "summary.json").read_text())
    assert html.escape(summary["result"]["sentence"]) in report
    assert f"folder {finished.name}" in report
    # Nobody asked whether bodies touch, and the result in words does not say.
    assert "Whether bodies touch was not looked at" in report
    for term in summary["terms"]:
        assert term.replace("_", " ") in report
    assert replay.count('class="plots"') == 2
    assert max(map(len, (replay, report))) < 3e6


@pytest.mark.slow
def test_show_writes_figures_and_pages(finished, tmp_path, capsys):
    before = sorted(path.name for path in finished.iterdir())
    pages = [tmp_path / "replay.html", tmp_path / "report.html"]
    told = ["--html", str(pages[0]), "--report", str(pages[1])]
    assert cli.main(["show", str(finished), str(finished), *told[:2]]) == cli.MET
    assert cli.main(["show", str(finished), *told[2:]]) == cli.MET
    report = pages[1].read_text(encoding="utf-8")
    assert report.count("data:image/png;base64,") == len(list((finished / "figures").glob("*.png")))
    shutil.rmtree(finished / "figures")
    assert sorted(path.name for path in finished.iterdir()) == before
    capsys.readouterr()


def test_two_runs_have_a_report_each_so_that_one_name_for_both_is_refused(finished, tmp_path, capsys):
    told = ["show", str(finished), str(finished), "--report", str(tmp_path / "report.html")]
    assert cli.main(told) == cli.BAD_INPUT
    assert "each of several runs has a report of its own" in capsys.readouterr().err


def test_the_summary_tells_how_far_the_base_turns(finished):
    """Beside SciPy's rotations of the written quaternions."""
    summary, dataset = (
        json.loads((finished / "summary.json").read_text()),
        open_dataset(finished / "result.nc"),
    )
    turned = Rotation.from_quat(dataset["base_quaternion"].values, scalar_first=True)
    angle = (turned[0].inv() * turned).magnitude()
    vectors = np.abs((turned[0].inv() * turned).as_rotvec())
    assert summary["base"]["largest_turn_about_an_axis_rad"] == pytest.approx(vectors.max(), abs=1e-12)
    moved = np.linalg.norm(dataset["base_position"].values - dataset["base_position"].values[0], axis=1)
    assert summary["base"]["final_turn_rad"] == pytest.approx(angle[-1], abs=1e-12)
    assert summary["base"]["largest_turn_rad"] == pytest.approx(angle.max(), abs=1e-12)
    assert summary["base"]["largest_displacement_m"] == pytest.approx(moved.max(), rel=1e-12)
    assert f"turned by {np.rad2deg(angle[-1]):.4g} deg at the end" in summary_text(summary)


def test_result_is_labelled_and_exact(finished):
    dataset = open_dataset(finished / "result.nc")
    chex.assert_tree_all_finite(dataset["base_quaternion"].to_numpy())
    chex.assert_shape(dataset["joint_position"].to_numpy(), (9, 6))
    assert dataset["joint_position"].attrs["units"] == "rad"
    assert list(dataset["joint"].to_numpy()) == [f"joint{i}" for i in range(1, 7)]
    np.testing.assert_allclose(
        np.rad2deg(dataset["joint_position"].to_numpy()[[0, -1]]),
        [[175, -60, -60, 0, 210, 5], [120, -30, -95, 40, 170, 60]],
        atol=1e-9,
    )
    best = dataset["history_best_value"].to_numpy()
    assert np.all(np.diff(best) <= 0)


def test_a_run_repeats_bit_for_bit_from_its_own_config(finished, tmp_path, capsys):
    status, _, _ = run(capsys, str(finished / "config.yaml"), "--out", str(tmp_path / "again"))
    assert status == cli.NOT_MET
    assert (tmp_path / "again/result.nc").read_bytes() == (finished / "result.nc").read_bytes()
    assert (tmp_path / "again/config.yaml").read_bytes() == (finished / "config.yaml").read_bytes()


def test_a_finished_run_says_so_and_is_left_alone(finished, capsys):
    before = (finished / "summary.json").read_bytes()
    status, out, _ = run(capsys, str(finished / "config.yaml"), "--out", str(finished))
    assert status == cli.NOT_MET
    assert "is finished" in out
    assert (finished / "summary.json").read_bytes() == before


@pytest.mark.parametrize("chunks_before_the_signal", [1, 2, 3])
def test_interrupted_and_resumed_ends_with_the_same_bits(
    chunks_before_the_signal, finished, small, tmp_path, capsys, monkeypatch
):
    save, count = searching.save_checkpoint, 0

    def save_then_signal(path, snapshot):
        nonlocal count
        save(path, snapshot)
        count += 1
        if count == chunks_before_the_signal:
            os.kill(os.getpid(), signal.SIGINT)

    folder = tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr(searching, "save_checkpoint", save_then_signal)
        status, _, err = run(capsys, CONFIG, *small, "--out", str(folder))
    if (folder / "summary.json").exists():
        pytest.fail("the signal came too late to interrupt anything")
    assert status == cli.INTERRUPTED
    assert "goes on from it" in err
    assert (folder / "checkpoint.npz").is_file()
    # What a kill in the middle of a line would leave.
    with open(folder / "metrics.jsonl", "a") as file:
        file.write('{"phase": "sw')
    status, out, _ = run(capsys, CONFIG, *small, "--out", str(folder))
    assert status == cli.NOT_MET
    assert "going on from" in out
    for name in ("result.nc", "metrics.jsonl"):
        assert (folder / name).read_bytes() == (finished / name).read_bytes()
    assert not (folder / "checkpoint.npz").exists()


def test_a_damaged_checkpoint_is_told(finished, small, tmp_path, capsys):
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "config.yaml").write_bytes((finished / "config.yaml").read_bytes())
    (folder / "checkpoint.npz").write_bytes(b"PK\x03\x04 half a file")
    status, _, err = run(capsys, CONFIG, *small, "verification.sensitivity=true", "--out", str(folder))
    assert status == cli.BAD_INPUT
    assert "the checkpoint cannot be read" in err


def test_another_configuration_is_refused(finished, small, capsys):
    status, _, err = run(capsys, CONFIG, *small, "seed=1", "--out", str(finished))
    assert status == cli.BAD_INPUT
    assert "holds a run of another configuration" in err


def test_a_folder_of_something_else_is_refused(small, tmp_path, capsys):
    (tmp_path / "thesis.tex").write_text("years of work")
    status, _, err = run(capsys, CONFIG, *small, "--out", str(tmp_path))
    assert status == cli.BAD_INPUT
    assert "holds no run" in err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_without_out_runs_are_numbered(small, tmp_path, capsys, monkeypatch):
    config = os.path.abspath(CONFIG)
    monkeypatch.chdir(tmp_path)
    for expected in ("runs/composite_wu6", "runs/composite_wu6-2"):
        run(capsys, config, *small)
        assert (tmp_path / expected / "summary.json").is_file()


def test_impossible_is_refused_before_any_search(small, tmp_path, capsys):
    status, _, err = run(capsys, "composite_wu6_impossible", *small, "--out", str(tmp_path / "run"))
    assert status == cli.BAD_INPUT
    assert err.count("\n") == 1
    for part in ("task.duration", "joint6", "55 deg", "0.2 rad/s^2", "4.38 s", "at least 5.09 s"):
        assert part in err
    assert not (tmp_path / "run").exists()


def test_a_full_disk_is_told_in_one_sentence(small, tmp_path, capsys, monkeypatch):
    def fill(*arguments, **keywords):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(planning, "run_planning", fill)
    status, _, err = run(capsys, CONFIG, *small, "--out", str(tmp_path / "run"))
    assert status == cli.BAD_INPUT
    assert err == "jffsr: No space left on device; make room and repeat the command\n"


@pytest.mark.slow
def test_float32_is_searched_and_verified_in_float64(small, tmp_path):
    swarm = [*small, "precision=float32", "optimizer.kind=qpso", "optimizer.evaluations=16"]
    code = (
        "import sys; from jffsr.cli import main; "
        f"sys.exit(main(['run', {CONFIG!r}, *{swarm!r}, '--out', {str(tmp_path / 'f')!r}]))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == cli.NOT_MET, done.stderr
    summary = json.loads((tmp_path / "f/summary.json").read_text())
    # In float32 the ends would be missed by some 1e-6.
    assert summary["verification"]["boundary_error"] < 1e-10
    assert summary["sensitivity"] is None


def test_help_and_catalogue_do_not_import_jax():
    for arguments in (["--help"], ["run", "--help"]):
        code = (
            "import sys, jffsr.cli\n"
            f"try: jffsr.cli.main({arguments!r})\n"
            "except SystemExit: pass\n"
            "heavy = {'jax', 'numpy', 'matplotlib', 'xarray', 'mujoco'} & set(sys.modules)\n"
            "sys.exit(f'imported: {heavy}' if heavy else 0)"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "usage: jffsr" in done.stdout


def test_robots_lists_sources(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # where the picture goes
    assert cli.main(["robots"]) == cli.MET
    listing = capsys.readouterr().out
    for name in ("hu_2011_planar2", "ye_2019_planar3", "wu_2018_6dof", "servicer_7dof"):
        assert name in listing
    assert listing.count("source: ") >= 4
    assert cli.main(["robots", "wu_6dof"]) == cli.MET
    assert "Complexity" in capsys.readouterr().out
    assert cli.main(["robots", "wu6"]) == cli.BAD_INPUT
    assert "did you mean 'wu_6dof'?" in capsys.readouterr().err


def test_plan_in_python_equals_the_command(finished, small):
    import jffsr

    plan = jffsr.plan(CONFIG, overrides=small)
    summary = json.loads((finished / "summary.json").read_text())
    assert plan.cost == summary["cost"]
    assert plan.result.code == summary["result"]["code"]
    dataset = open_dataset(finished / "result.nc")
    np.testing.assert_array_equal(plan.motion.base_quaternion, dataset["base_quaternion"].to_numpy())
