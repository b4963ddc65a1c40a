"""Plan the captures of a set in parts, keep what came of each, and go on where it was stopped."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import jax
import numpy as np

from experiments.captures.sampling import (
    Sample,
    draw,
    initial_state,
    judge,
    model_of,
    motion_of,
    robot,
)
from jffsr.capture.candidates import CandidateSettings
from jffsr.capture.captures import CaptureSettings, CaptureTask, plan_captures
from jffsr.capture.grasp_path import GraspPath
from jffsr.capture.match import grasp_error
from jffsr.capture.outcome import CaptureCode
from jffsr.compiling import jit

SETTINGS = CaptureSettings(tolerance=1e-4, margin=0.02)
AGAIN = replace(
    SETTINGS,
    candidates=CandidateSettings(
        times=8, apart=1.0, starts=32, postures=8, largest_bow=1.0, iterations=12, seed=2
    ),
    control_points=12,
    num_steps=100,
    windows=16,
)
"""For those that the first settings do not solve: more times and postures, bent ways, more freedom, a finer grid."""


def read_lines(path: Path) -> list[dict]:
    """What a file of JSON lines holds; a last line that was cut short is left out."""
    if not path.exists():
        return []
    found = []
    for line in path.read_text().splitlines():
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            break
    return found


def write_line(path: Path, line: dict) -> None:
    """Add a line, whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        file.write(json.dumps(line) + "\n")


def sampled(path: Path, seed: int, count: int, at_once: int = 64) -> list[dict]:
    """Verdicts of all samples drawn for `count` feasible ones: lines with number, reason and time."""
    lines = read_lines(path)
    while sum(line["reason"] == 0 for line in lines) < count:
        numbers = range(len(lines), len(lines) + at_once)
        verdict = judge([draw(seed, number) for number in numbers])
        for number, reason, when in zip(numbers, verdict.reason, verdict.time, strict=True):
            line = {"number": number, "reason": int(reason), "time": float(when)}
            write_line(path, line)
            lines.append(line)
    return lines


def feasible(lines: list[dict], count: int) -> list[int]:
    """Numbers of the first `count` feasible samples."""
    return [line["number"] for line in lines if line["reason"] == 0][:count]


@jit
def _errors(problem, free):
    motion = problem.motion(free)
    return grasp_error(problem.robot, motion, problem.constraints[0].path)


def planned(
    path: Path, seed: int, numbers: list[int], part: int, base_mode: str, settings: CaptureSettings
) -> list[dict]:
    """Results of these samples, planned `part` at a time: code, errors, attempts, seconds."""
    lines = read_lines(path)
    left = [n for n in numbers if n not in {line["number"] for line in lines}]
    for start in range(0, len(left), part):
        batch = left[start : start + part]
        samples = [draw(seed, number) for number in batch]
        # A last part that is short is filled up, and counts as what it cost: one shape is compiled.
        filled = samples + samples[:1] * (part - len(samples))
        if start == 0:
            # Compiled beforehand, on the same shapes: the time of a plan is what is wanted here.
            _solved(filled, settings, base_mode)
        begin = time.perf_counter()
        found = _solved(filled, settings, base_mode)
        seconds = time.perf_counter() - begin
        for number, one in zip(batch, found, strict=False):
            line = {"number": number, "seconds": seconds / part, **one}
            write_line(path, line)
            lines.append(line)
        print(
            f"{len(lines)} of {len(numbers)}: {_share(lines):.4f} captured, {seconds:.1f} s a part",
            flush=True,
        )
    return lines


def is_captured(line: dict) -> bool:
    """Whether a line tells of a capture that the re-run says is one."""
    return line["code"] == CaptureCode.CAPTURED


def _share(lines: list[dict]) -> float:
    return float(np.mean([is_captured(line) for line in lines]))


def _solved(samples: list[Sample], settings: CaptureSettings, base_mode: str) -> list[dict]:
    tasks = [CaptureTask(GraspPath.create(motion_of(sample)), model_of(sample)) for sample in samples]
    found = plan_captures(robot(), tasks, initial_state(), settings, base_mode=base_mode)
    lines = []
    for k in range(len(samples)):
        error = np.abs(jax.device_get(_errors(found.problems[k], found.free[k])))
        violations = {name: float(value[k]) for name, value in found.verification.violations.items()}
        lines.append(
            {
                "code": int(found.code[k]),
                "duration": float(found.duration[k]),
                "attempts": int(found.attempts[k]),
                "jacobians": int(found.jacobians[k]),
                "errors": [float(error[i : i + 3].max()) for i in (0, 3, 6, 9)],
                "violations": violations,
                "free": [round(float(x), 12) for x in found.free[k]],
            }
        )
    return lines
