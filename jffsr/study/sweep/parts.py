"""The finished parts of a sweep on disk.

A part is one file with the results of one task, written whole or not at all. The files that are there are the only
record of what is done: no list beside them could differ from them after a kill.
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jffsr.errors import InputError
from jffsr.study.sweep.compute import Results
from jffsr.study.sweep.tasks import Task
from jffsr.writing import write_atomically

_FORMAT = 1
_ENDING = ".npz"


@dataclass(frozen=True)
class Part:
    """Numbers of the points of a part, and their results."""

    numbers: tuple[int, ...]
    results: Results


def save_part(folder: Path, task: Task, results: Results) -> None:
    """Write the results of a task; raises OSError where there is no room for it, and leaves nothing half."""
    head = json.dumps({"format": _FORMAT, "numbers": task.numbers, "marks": task.marks}).encode()
    buffer = io.BytesIO()
    np.savez_compressed(buffer, head=np.frombuffer(head, dtype=np.uint8), **results)
    path = folder / f"{task.numbers[0]:07d}{_ENDING}"
    write_atomically(path, lambda part: _write(part, buffer.getbuffer()))


def _write(path: Path, data: memoryview) -> None:
    path.write_bytes(data)


def load_parts(folder: Path, tasks: Sequence[Task]) -> list[Part]:
    """The parts that are there, after what a kill left half written is swept out.

    A file that a failing disk damaged is put aside, its points to be computed again. InputError where the parts are
    of other points: the robot's file or the user's own terms were changed under them.
    """
    marks = {number: mark for task in tasks for number, mark in zip(task.numbers, task.marks, strict=True)}
    for left in folder.glob(".*.part"):
        left.unlink(missing_ok=True)
    parts = []
    for path in sorted(folder.glob(f"*{_ENDING}")):
        try:
            part, found = read_part(path)
        except Exception:
            path.replace(path.with_suffix(".damaged"))
            continue
        if any(marks.get(number) != mark for number, mark in zip(part.numbers, found, strict=True)):
            raise InputError(
                f"{path}: these results are of other numbers (a robot's file or the package has changed since); "
                f"give another folder"
            )
        parts.append(part)
    return parts


def read_part(path: Path) -> tuple[Part, list[str]]:
    """A part's file, and the marks of its points; raises whatever NumPy does where it is damaged."""
    with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
        head = json.loads(file["head"].tobytes())
        results = {name: file[name] for name in file.files if name != "head"}
    if head["format"] != _FORMAT:
        raise ValueError("of another version")
    return Part(tuple(head["numbers"]), results), head["marks"]
