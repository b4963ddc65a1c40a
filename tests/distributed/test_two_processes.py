"""Two processes on this machine search as one: the same numbers as alone, also after some of them were killed."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from time_limit import within

import jffsr
from jffsr.study.dataset import open_dataset

pytestmark = pytest.mark.distributed

SMALL = [
    "rollout.num_steps=8",
    "verification.step_factor=2",
    "verification.sensitivity=false",
    "optimizer.particles=5",
    "optimizer.swarm_evaluations=20",
    "optimizer.starts=3",
    "optimizer.gradient_iterations=6",
    "optimizer.polish_iterations=2",
    "optimizer.chunk=2",
    "optimizer.memory=3",
    "output.figures=false",
    "output.progress=false",
]
# Long enough to be killed on the way.
LONG = [*SMALL, "optimizer.kind=qpso", "optimizer.particles=16", "optimizer.evaluations=16000"]
CACHE: dict[str, str] = {}
LOST = 90
"""s, after which a process whose partner has gone must have ended."""


@pytest.fixture(scope="module", autouse=True)
def compilation_cache(tmp_path_factory):
    """Compiled programs are kept in a folder of the tests'."""
    CACHE["JFFSR_CACHE_DIR"] = str(tmp_path_factory.mktemp("xla"))


def start(folder: Path, overrides: list[str], together: list[str]) -> subprocess.Popen:
    """One process of `jffsr run`, its output in a file beside the run folder."""
    log = folder.with_suffix(f".{together[-1] if together else 'alone'}.log")
    command = ["-m", "jffsr.cli", "run", "composite_wu6", *overrides, "--out", str(folder), *together]
    root = Path(jffsr.__file__).parents[1]
    with open(log, "ab") as file:
        return subprocess.Popen(
            [sys.executable, *command],
            stdout=file,
            stderr=subprocess.STDOUT,
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root), "JAX_NUM_CPU_DEVICES": "1", **CACHE},
        )


def start_two(folder: Path, overrides: list[str]) -> list[subprocess.Popen]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    where = ["--coordinator", f"127.0.0.1:{port}", "--processes", "2"]
    return [start(folder, overrides, [*where, "--process", str(i)]) for i in range(2)]


def finish(processes: list[subprocess.Popen], seconds: float = 600) -> list[int]:
    """Their exit statuses."""
    try:
        return [process.wait(seconds) for process in processes]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def wait_for_checkpoint(folder: Path, processes: list[subprocess.Popen]) -> None:
    with within(300):
        while not (folder / "checkpoint.npz").is_file():
            assert all(process.poll() is None for process in processes), "ended before it was stopped"
            time.sleep(0.02)


def assert_same_result(one: Path, other: Path, tolerance: float = 1e-12) -> None:
    first, second = (open_dataset(folder / "result.nc") for folder in (one, other))
    assert set(first) == set(second)
    for name in first:
        if first[name].dtype.kind == "f":
            np.testing.assert_allclose(
                second[name], first[name], rtol=tolerance, atol=tolerance, err_msg=name
            )


@pytest.fixture(scope="module")
def long_uninterrupted(tmp_path_factory):
    """The long run in two processes that nobody kills."""
    folder = tmp_path_factory.mktemp("uninterrupted") / "run"
    assert finish(start_two(folder, LONG)) == [3, 3]
    return folder


def test_two_find_what_one_finds(tmp_path):
    """A swarm of five and three starts, over two processes, both uneven."""
    assert finish([start(tmp_path / "one", SMALL, [])]) == [3]
    assert finish(start_two(tmp_path / "two", SMALL)) == [3, 3]
    assert_same_result(tmp_path / "one", tmp_path / "two")
    assert "not verified" in (tmp_path / "two.0.log").read_text()
    assert "not verified" not in (tmp_path / "two.1.log").read_text()
    assert {path.name for path in (tmp_path / "two").iterdir()} == {
        "config.yaml",
        "metrics.jsonl",
        "result.nc",
        "summary.json",
    }


@pytest.mark.parametrize("killed", [(0,), (1,), (0, 1)])
def test_killed_on_the_way_they_go_on_to_the_same_bits(killed, long_uninterrupted, tmp_path):
    folder = tmp_path / "run"
    processes = start_two(folder, LONG)
    try:
        wait_for_checkpoint(folder, processes)
        for i in killed:
            processes[i].send_signal(signal.SIGKILL)
    finally:
        statuses = finish(processes, LOST)
    assert all(statuses)
    assert not (folder / "summary.json").exists()
    assert finish(start_two(folder, LONG)) == [3, 3]
    assert "going on from" in (tmp_path / "run.0.log").read_text()
    assert_same_result(long_uninterrupted, folder, tolerance=0.0)


def test_ctrl_c_to_one_stops_all_with_a_checkpoint(tmp_path):
    folder = tmp_path / "run"
    processes = start_two(folder, LONG)
    try:
        wait_for_checkpoint(folder, processes)
        processes[1].send_signal(signal.SIGINT)
    finally:
        statuses = finish(processes)
    assert statuses == [130, 130]
    assert (folder / "checkpoint.npz").is_file()


def test_a_wrong_input_ends_all(tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    assert finish(start_two(tmp_path, SMALL)) == [2, 2]
