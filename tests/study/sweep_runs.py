"""Small sweeps of the planar arm, alike in every test that runs one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import jffsr
from jffsr import cli

BASE = """\
kind: planning
robot: hu_2011_planar2
limits: {position_deg: 180, rate: 0.5, acceleration: 0.5}
task:
  start_deg: [80, 30]
  goal_deg: [-60, 90]
  duration: 20
rollout: {num_steps: 8}
verification: {step_factor: 2, sensitivity: false}
optimizer: {kind: qpso, particles: 4, evaluations: 40}
output: {figures: false, progress: false}
"""
SWEPT = ("task.duration=20,25", "optimizer.contraction=[1.0,0.5],[0.9,0.4]", "seeds=3")
"""Twelve points, which share one program."""


def write_base(folder: Path) -> str:
    """The planning configuration to sweep over."""
    path = folder / "planar.yaml"
    path.write_text(BASE, encoding="utf-8")
    return str(path)


def sweep(base: str, *arguments: str, out: Path, together: int = 4) -> int:
    """`jffsr sweep` in this process; its exit status."""
    return cli.main(["sweep", base, *arguments, "--out", str(out), "--together", str(together)])


def start(base: str, *arguments: str, out: Path, log: Path) -> subprocess.Popen:
    """`jffsr sweep` in a process of its own, what it says appended to `log`."""
    root = Path(jffsr.__file__).parents[1]
    with open(log, "ab") as file:
        return subprocess.Popen(
            [sys.executable, "-m", "jffsr.cli", "sweep", base, *arguments, "--out", str(out)],
            stdout=file,
            stderr=subprocess.STDOUT,
            env={**os.environ, "PYTHONPATH": str(root)},
        )


def parts_of(folder: Path) -> dict[str, tuple[int, int, bytes]]:
    """The finished parts, each with what would change if it were written again."""
    found = {}
    for path in folder.glob("parts/*.npz"):
        status = path.stat()
        found[path.name] = (status.st_ino, status.st_mtime_ns, path.read_bytes())
    return found
