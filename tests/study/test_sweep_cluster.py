"""A sweep by the workers of a dask cluster on this machine, one of which is killed; and no scheduler at all."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from sweep_runs import parts_of, start, write_base
from time_limit import within

import jffsr
from jffsr import cli
from jffsr.study.dataset import open_dataset

ROOT = str(Path(jffsr.__file__).parents[1])
ARGUMENTS = ("task.duration=20,22,24,26,28,30,32,34", "seeds=4", "rollout.num_steps=4", "--together", "2")


def dask(folder: Path, *arguments: str) -> subprocess.Popen:
    """One process of the cluster, what it says in a file."""
    with open(folder / "dask.log", "ab") as file:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *arguments],
            stdout=file,
            stderr=subprocess.STDOUT,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": ROOT},
        )


@pytest.fixture
def cluster(tmp_path):
    """The address of a scheduler, and its two workers."""
    described = tmp_path / "scheduler.json"
    scheduler = dask(
        tmp_path, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-jupyter",
        "--scheduler-file", str(described),
    )  # fmt: skip
    workers = []
    try:
        with within(120):
            while not described.is_file() or not described.read_text().strip().endswith("}"):
                assert scheduler.poll() is None, (tmp_path / "dask.log").read_text()
                time.sleep(0.1)
            address = json.loads(described.read_text())["address"]
        workers = [
            dask(tmp_path, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
            for _ in range(2)
        ]
        yield address, workers
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()


@pytest.mark.cluster
def test_a_lost_worker_loses_nothing(cluster, tmp_path):
    address, workers = cluster
    base, folder, log = write_base(tmp_path), tmp_path / "cluster", tmp_path / "sweep.log"
    process = start(base, *ARGUMENTS, "--scheduler", address, out=folder, log=log)
    try:
        with within(900):
            while process.poll() is None and not parts_of(folder):
                time.sleep(0.02)
            assert process.poll() is None, log.read_text()
            workers[0].send_signal(signal.SIGKILL)
            assert process.wait() == cli.NOT_MET, log.read_text()
    finally:
        process.kill()
        process.wait()
    assert len(parts_of(folder)) == 16
    with within(900):
        assert start(base, *ARGUMENTS, out=tmp_path / "here", log=log).wait() == cli.NOT_MET, log.read_text()
    one, other = (open_dataset(where / "sweep.nc") for where in (folder, tmp_path / "here"))
    assert other.sizes["point"] == 32
    for name in ("code", "cost", "free_numbers", "evaluations"):
        # Workers may have another number of devices, over which the same sums are rounded otherwise.
        assert abs(one[name] - other[name]).max() <= 1e-9 * abs(other[name]).max(), name


@pytest.mark.cluster
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nowhere.invalid:8786", "what?"])
def test_no_scheduler_is_told_in_one_sentence_within_seconds(address, tmp_path, capfd):
    base = write_base(tmp_path)
    arguments = ["sweep", base, "seeds=2", "--scheduler", address, "--out", str(tmp_path / "s")]
    with within(30):
        assert cli.main(arguments) == cli.BAD_INPUT
    said = capfd.readouterr().err
    assert f"--scheduler {address}: no scheduler answers there" in said
    assert said.count("\n") == 1
    assert not (tmp_path / "s").exists()


def test_without_the_extra_it_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    base = write_base(tmp_path)
    assert cli.main(["sweep", base, "seeds=2", "--scheduler", "tcp://127.0.0.1:9"]) == cli.BAD_INPUT
    assert "pip install 'jffsr[cluster]'" in capsys.readouterr().err
