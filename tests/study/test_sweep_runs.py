"""Sweeps in folders: the same as single runs, gone on with after any end, and one file at the end."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal

import numpy as np
import pytest
from sweep_runs import SWEPT, parts_of, sweep, write_base

import jffsr
from jffsr import cli
from jffsr.planning import many
from jffsr.study.dataset import open_dataset
from jffsr.study.sweep import local, running
from jffsr.study.sweep.ended import read_ended
from jffsr.study.sweep.points import expand
from jffsr.study.sweep.specification import read_sweep
from jffsr.study.sweep.tasks import sort_into_tasks
from jffsr.viz.replay.of_sweep import sweep_replays


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    return write_base(tmp_path_factory.mktemp("base"))


@pytest.fixture(scope="module")
def finished(base, tmp_path_factory):
    """The folder of a finished sweep of twelve points in three calls."""
    folder = tmp_path_factory.mktemp("sweeps") / "finished"
    many._plan_chunk.clear_cache()
    assert sweep(base, *SWEPT, out=folder) == cli.NOT_MET
    assert many._plan_chunk._cache_size() == 1
    return folder


def test_folder_holds_what_is_promised(finished):
    names = {path.name for path in finished.iterdir() if not path.name.startswith(".")}
    assert names == {"config.yaml", "parts", "sweep.nc", "summary.json", "table.md"}
    assert sorted(parts_of(finished)) == ["0000000.npz", "0000004.npz", "0000008.npz"]
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["kind"] == "sweep"
    assert summary["points"] == summary["computed"] == 12
    assert summary["evaluations"] == {"objective": 12 * 40, "gradient": 0}
    table = (finished / "table.md").read_text()
    assert table.count("\n| 2") == 4


def test_merged_file_is_labelled(finished):
    dataset = open_dataset(finished / "sweep.nc")
    assert dataset.sizes["point"] == 12
    assert json.loads(dataset.attrs["swept_keys"]) == ["task.duration", "optimizer.contraction", "seed"]
    np.testing.assert_array_equal(dataset["task.duration"], np.repeat([20, 25], 6))
    assert list(dataset["optimizer.contraction"].values[[0, 3]]) == ["[1.0, 0.5]", "[0.9, 0.4]"]
    np.testing.assert_array_equal(dataset["seed"], np.tile([0, 1, 2], 4))
    assert dataset["task.duration"].attrs["units"] == "s"
    assert {str(variable.attrs.get("units")) for variable in dataset.data_vars.values()} <= {
        "1",
        "s",
        "rad",
        "m",
    }
    np.testing.assert_allclose(dataset["duration"], dataset["task.duration"])
    np.testing.assert_allclose(dataset["term_weighted"].sum("term"), dataset["cost_finer"], rtol=1e-12)
    np.testing.assert_array_equal(dataset["history_best_value"][:, -1], dataset["cost"])
    np.testing.assert_array_equal(dataset["history_evaluations"][0], np.arange(4, 44, 4))
    assert np.all(np.diff(dataset["history_best_value"], axis=1) <= 0)


def test_only_types_that_every_reader_knows(finished):
    import h5py

    with h5py.File(finished / "sweep.nc") as file:
        kinds = {name: variable.dtype.str for name, variable in file.items()}
    assert kinds["term"] == kinds["optimizer.contraction"] == "|S1"
    assert {kinds["cost"], kinds["seed"]} == {"<f8", "<i8"}


@pytest.mark.parametrize("number", [0, 4, 11])
def test_planned_together_is_planned_alone(number, base, finished):
    """`jffsr run` of a point, by the driver and another program: equal to rounding."""
    spec = read_sweep(base, list(SWEPT))
    plan = jffsr.plan(expand(spec)[number].config)
    dataset = open_dataset(finished / "sweep.nc").isel(point=number)
    np.testing.assert_allclose(dataset["cost"], plan.cost, rtol=1e-9)
    np.testing.assert_allclose(dataset["free_numbers"], plan.free, rtol=1e-9, atol=1e-12)
    assert int(dataset["code"]) == plan.result.code
    assert int(dataset["evaluations"]) == plan.evaluations
    assert list(dataset["term"].values) == sorted(plan.terms)


def test_a_finished_sweep_says_so_and_is_left_alone(base, finished, capsys):
    before = parts_of(finished), (finished / "sweep.nc").stat().st_mtime_ns
    assert sweep(base, *SWEPT, out=finished) == cli.NOT_MET
    assert "is finished" in capsys.readouterr().out
    assert (parts_of(finished), (finished / "sweep.nc").stat().st_mtime_ns) == before


def test_its_own_configuration_repeats_it(finished, tmp_path):
    assert sweep(str(finished / "config.yaml"), out=tmp_path / "again") == cli.NOT_MET
    assert (tmp_path / "again/sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()


def test_the_best_setting_is_told(finished, capsys):
    assert cli.main(["sweep", str(finished / "config.yaml"), "--out", str(finished)]) == cli.NOT_MET
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["best_setting"].startswith("task.duration = ")
    assert f"  best    {summary['best_setting']}" in capsys.readouterr().out


def test_run_takes_a_sweep_too(finished, capsys):
    assert cli.main(["run", str(finished / "config.yaml"), "--out", str(finished)]) == cli.NOT_MET
    assert "is finished" in capsys.readouterr().out


@pytest.mark.parametrize("parts", [1, 2, 3])
def test_cut_short_it_goes_on_to_the_same_bytes(parts, base, finished, tmp_path, monkeypatch, capsys):
    """Ended in the middle of the next part, as a kill would, half a file left behind."""
    folder, save, count = tmp_path / "s", running.save_part, 0

    def save_then_die(path, task, results):
        nonlocal count
        if count == parts:
            raise KeyboardInterrupt
        save(path, task, results)
        count += 1

    with monkeypatch.context() as patch:
        if parts < 3:
            patch.setattr(running, "save_part", save_then_die)
        else:
            patch.setattr(running, "save_sweep", lambda *arguments: (_ for _ in ()).throw(KeyboardInterrupt))
        assert sweep(base, *SWEPT, out=folder) == cli.INTERRUPTED
    before = parts_of(folder)
    assert len(before) == parts
    (folder / "parts" / ".0000008.npz.1.part").write_bytes(b"half")
    assert sweep(base, *SWEPT, out=folder) == cli.NOT_MET
    assert f"{4 * parts} of them done already" in capsys.readouterr().out
    after = parts_of(folder)
    assert {name: after[name] for name in before} == before
    assert (folder / "sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()
    assert not list(folder.glob("parts/.*"))


def test_ctrl_c_stops_after_the_call_under_way(base, finished, tmp_path, monkeypatch, capsys):
    folder, save = tmp_path / "s", running.save_part

    def save_then_signal(*arguments):
        save(*arguments)
        os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(running, "save_part", save_then_signal)
        assert sweep(base, *SWEPT, out=folder) == cli.INTERRUPTED
    assert f"the same command with --out {folder} goes on from it" in capsys.readouterr().err
    assert list(parts_of(folder)) == ["0000000.npz"]
    assert sweep(base, *SWEPT, out=folder) == cli.NOT_MET
    assert (folder / "sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()


def test_a_damaged_part_is_computed_again(base, finished, tmp_path):
    shutil.copytree(finished, tmp_path / "s")
    part = tmp_path / "s/parts/0000004.npz"
    part.write_bytes(part.read_bytes()[:1000])
    assert sweep(base, *SWEPT, out=tmp_path / "s") == cli.NOT_MET
    assert (tmp_path / "s/sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()
    assert (tmp_path / "s/parts/0000004.damaged").is_file()


def test_parts_of_other_numbers_are_refused(base, finished, tmp_path, capsys):
    shutil.copytree(finished, tmp_path / "s")
    shutil.copy(finished / "parts/0000000.npz", tmp_path / "s/parts/0000004.npz")
    config = (tmp_path / "s/config.yaml").read_text().replace("rate: 0.5", "rate: 0.6")
    (tmp_path / "s/config.yaml").write_text(config)
    assert sweep(str(tmp_path / "s/config.yaml"), out=tmp_path / "s") == cli.BAD_INPUT
    assert "these results are of other numbers" in capsys.readouterr().err


def test_folders_of_others_are_refused(base, finished, tmp_path, capsys):
    assert sweep(base, *SWEPT[:2], out=finished) == cli.BAD_INPUT
    assert "holds another sweep" in capsys.readouterr().err
    (tmp_path / "thesis.tex").write_text("years of work")
    assert sweep(base, *SWEPT, out=tmp_path) == cli.BAD_INPUT
    assert "holds no sweep" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_two_at_once_in_one_folder_are_refused(base, finished, capsys):
    import fcntl

    with open(finished / ".lock", "wb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert sweep(base, *SWEPT, out=finished) == cli.BAD_INPUT
    assert "another process is at work" in capsys.readouterr().err


def test_a_full_disk_loses_nothing_finished(base, finished, tmp_path, monkeypatch, capsys):
    """The second part is cut off by a limit on the size of files, as a full disk would."""
    import resource

    folder, save, limits = tmp_path / "s", running.save_part, resource.getrlimit(resource.RLIMIT_FSIZE)

    def save_with_no_room(path, task, results):
        if task.numbers[0] > 0:
            resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
        try:
            save(path, task, results)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)

    with monkeypatch.context() as patch:
        patch.setattr(running, "save_part", save_with_no_room)
        assert sweep(base, *SWEPT, out=folder) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert f"{folder}: cannot be written (File too large); 4 of 12 points are finished and kept" in said
    assert said.count("\n") == 1
    assert list(parts_of(folder)) == ["0000000.npz"]
    assert not list(folder.glob("parts/.*"))
    assert sweep(base, *SWEPT, out=folder) == cli.NOT_MET
    assert (folder / "sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()


def test_a_disk_full_at_the_end_keeps_every_part(base, finished, tmp_path, capsys):
    import resource

    shutil.copytree(finished, tmp_path / "s")
    for name in ("sweep.nc", "summary.json"):
        (tmp_path / "s" / name).unlink()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
    try:
        assert sweep(base, *SWEPT, out=tmp_path / "s") == cli.BAD_INPUT
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    said = capsys.readouterr().err
    assert "12 of 12 points are finished and kept, make room" in said
    assert said.count("\n") == 1
    assert not list((tmp_path / "s").glob("*.part")) + list((tmp_path / "s").glob(".*.part"))
    assert sweep(base, *SWEPT, out=tmp_path / "s") == cli.NOT_MET
    assert (tmp_path / "s/sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()


def test_a_call_that_fails_takes_no_other_with_it(base, finished, tmp_path, monkeypatch, capsys):
    compute, folder = local.run_task, tmp_path / "s"

    def fail_at_the_second(task):
        if task.numbers[0] == 4:
            raise MemoryError("no memory for\nthat")
        return compute(task)

    with monkeypatch.context() as patch:
        patch.setattr(local, "run_task", fail_at_the_second)
        assert sweep(base, *SWEPT, out=folder) == cli.DEFECT
    assert "points 4 to 7 (4 of them): MemoryError: no memory for that" in capsys.readouterr().err
    dataset = open_dataset(folder / "sweep.nc")
    np.testing.assert_array_equal(dataset["code"].values == -1, np.arange(12) // 4 == 1)
    assert set(dataset["failure"].values[4:8]) == {"MemoryError: no memory for that"}
    told = read_ended(folder)
    assert told["failures"] == ["points 4, 5, 6, 7: MemoryError: no memory for that"]
    assert told["result"]["sentence"].endswith("4 could not be computed")
    assert sweep(base, *SWEPT, out=folder) == cli.NOT_MET
    assert (folder / "sweep.nc").read_bytes() == (finished / "sweep.nc").read_bytes()


@pytest.mark.slow
def test_the_report_shows_the_best_motions(finished, tmp_path, capsys):
    file = tmp_path / "shared" / "sweep.html"
    assert cli.main(["show", str(finished), "--report", str(file), "--no-serve"]) == cli.MET
    assert str(file) in capsys.readouterr().out
    text = file.read_text(encoding="utf-8")
    assert len(text) < 3e6
    dataset = open_dataset(finished / "sweep.nc")
    replays = sweep_replays(finished)
    assert len(replays) == min(4, dataset.sizes["point"] // 3)
    for replay in replays:
        # Each goes from the start to the goal in the time that its title names.
        duration = float(replay.title.split("duration ")[1].split(",")[0])
        assert replay.time[-1] == pytest.approx(duration)
        assert f">{replay.title}</option>" in text
        ends = np.array(
            next(panel for panel in replay.panels if panel.title == "joint rates").curves["joint1"]
        )
        np.testing.assert_allclose(ends[[0, -1]], 0.0, atol=1e-9)
    assert text.count("<tr>") > dataset.sizes["point"] // 3


def test_tasks_share_shapes_and_are_alike_in_size(base):
    arguments = [
        "optimizer.kind=qpso,hybrid",
        "optimizer.evaluations=40,80",
        "task.duration=20,25",
        "seeds=5",
    ]
    tasks = sort_into_tasks(expand(read_sweep(base, [*arguments, "optimizer.swarm_evaluations=40"])), 8)
    assert sorted(number for task in tasks for number in task.numbers) == list(range(40))
    for task in tasks:
        assert (
            len({(s.optimizer, s.settings.evaluations) for s in task.settings if s.optimizer == "qpso"}) <= 1
        )
    # Of the hybrid the budget of qpso alone shapes nothing.
    assert [len(task.numbers) for task in tasks] == [5, 5, 5, 5, 7, 7, 6]
    single = sort_into_tasks(expand(read_sweep(base, ["precision=float32,float64", "seeds=2"])))
    assert [task.width for task in single] == [2, None, None]


def test_errno_is_told_in_words():
    error = OSError(errno.ENOSPC, "No space left on device")
    folder = running.SweepFolder(running.Path("x"))
    assert "x: cannot be written (No space left on device); 3 of 9" in str(
        running._no_room(folder, error, 3, 9)
    )
