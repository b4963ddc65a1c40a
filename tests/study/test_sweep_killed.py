"""A sweep killed at random instants, and begun again each time, ends as one that was left in peace."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest
from sweep_runs import parts_of, start, write_base
from time_limit import within

from jffsr import cli
from jffsr.study.dataset import open_dataset

TOGETHER = ("--together", "2")
STARTING = 6
"""s, in which a kill falls before the first part, or among the first."""


def write_sweep(folder: Path, count: int, alone: int) -> str:
    """A sweep of `count` points of two programs, and `alone` more that share no shapes with any other."""
    write_base(folder)
    rows = [
        f"- {{seed: {i // 2}, optimizer.evaluations: {40 + 40 * (i % 2)}, task.duration: {20 + i % 7}}}"
        for i in range(count)
    ]
    rows += [
        f"- {{seed: {i}, optimizer.particles: {5 + i}, optimizer.evaluations: 30}}" for i in range(alone)
    ]
    path = folder / "sweep.yaml"
    path.write_text("\n".join(["kind: sweep", "base: planar.yaml", "list:", *rows, ""]), encoding="utf-8")
    return str(path)


def kill_at_random(sweep: str, folder: Path, rng: random.Random, most: int) -> bool:
    """Begin or go on, and kill in a while: after some seconds, or after some more parts. Whether it was cut short."""
    before = parts_of(folder)
    process = start(sweep, *TOGETHER, out=folder, log=folder.with_suffix(".log"))
    try:
        with within(600):
            if rng.random() < 0.25:
                time.sleep(rng.uniform(0, STARTING))
            else:
                wanted = len(before) + rng.randint(1, most)
                while process.poll() is None and len(list(folder.glob("parts/*.npz"))) < wanted:
                    time.sleep(0.002)
                time.sleep(rng.uniform(0, 0.05))
        process.kill()
    finally:
        process.kill()
        cut_short = process.wait() < 0
    after = parts_of(folder)
    # Nothing that was finished is lost, or written once more.
    assert {name: after[name] for name in before} == before
    return cut_short


def finish(sweep: str, folder: Path) -> None:
    with within(1800):
        log = folder.with_suffix(".log")
        assert start(sweep, *TOGETHER, out=folder, log=log).wait() == cli.NOT_MET, log.read_text()


def check_killed(tmp_path: Path, sweep: str, kills: int, most: int, points: int) -> None:
    """`kills` times killed, the last time as soon as all parts are there; then left to its end, and compared."""
    finish(sweep, tmp_path / "peace")
    peace = {name: part[2] for name, part in parts_of(tmp_path / "peace").items()}
    folder, rng = tmp_path / "killed", random.Random(20)
    for _ in range(kills - 1):
        assert kill_at_random(sweep, folder, rng, most), "ended before it was killed"
    process = start(sweep, *TOGETHER, out=folder, log=folder.with_suffix(".log"))
    with within(1800):
        while process.poll() is None and len(list(folder.glob("parts/*.npz"))) < len(peace):
            time.sleep(0.002)
    process.kill()
    process.wait()
    before = parts_of(folder)
    finish(sweep, folder)
    after = parts_of(folder)
    assert after == before
    assert {name: part[2] for name, part in after.items()} == peace
    assert (folder / "sweep.nc").read_bytes() == (tmp_path / "peace/sweep.nc").read_bytes()
    assert open_dataset(folder / "sweep.nc").sizes["point"] == points
    assert not list(folder.glob("**/.*.part"))


@pytest.mark.slow
@pytest.mark.sweep
def test_killed_twice(tmp_path):
    check_killed(tmp_path, write_sweep(tmp_path, 12, 0), kills=2, most=3, points=12)


@pytest.mark.sweep
def test_killed_twenty_times(tmp_path):
    check_killed(tmp_path, write_sweep(tmp_path, 197, 3), kills=20, most=5, points=200)
