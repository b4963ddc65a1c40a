"""A sweep from its specification to its folder: expand, compute what is missing, merge, tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.study.atomic import write_json, write_text
from jffsr.study.interrupt import Interrupt
from jffsr.study.sweep.ended import summary_of
from jffsr.study.sweep.folder import SweepFolder, claim_sweep_folder
from jffsr.study.sweep.local import Outcome, run_here
from jffsr.study.sweep.merging import merged, save_sweep
from jffsr.study.sweep.parts import Part, load_parts, save_part
from jffsr.study.sweep.points import Point, expand
from jffsr.study.sweep.significance import compare
from jffsr.study.sweep.specification import Specification
from jffsr.study.sweep.table import MOST_PRINTED, keys_of, markdown
from jffsr.study.sweep.tasks import Task, sort_into_tasks
from jffsr.study.unused import unused_keys


@dataclass(frozen=True)
class Sweep:
    """How a sweep ended: its folder, its summary, its table, what failed, each with its reason, and whether to draw."""

    folder: SweepFolder
    summary: dict[str, Any] | None
    table: str = ""
    failures: tuple[str, ...] = ()
    figures: bool = False
    interrupted: bool = False
    already_finished: bool = False


def run_sweep(
    spec: Specification,
    out: str | Path | None,
    *,
    together: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Sweep:
    """Compute a sweep in its folder, going on from the parts that are there.

    Every point is checked before the folder is touched. At most `together` points are planned in one compiled call;
    `workers` processes plan what goes alone; with the address of a dask scheduler its workers do everything.
    InputError for what is wrong with the input, a scheduler that is not there, and a disk that is full.
    """
    for name, value in (("--together", together), ("--workers", workers)):
        if value is not None and value < 1:
            raise InputError(f"{name}: found {value}, a whole number from 1 on is expected")
    points = expand(spec)
    tasks = sort_into_tasks(points, together)
    client = None
    if scheduler is not None:
        from jffsr.study.sweep.cluster import connect

        client = connect(scheduler)
    try:
        folder = claim_sweep_folder(spec, out)
        with folder.alone():
            return _run(folder, spec, points, tasks, client, workers, say)
    finally:
        if client is not None:
            client.close()


def _run(
    folder: SweepFolder,
    spec: Specification,
    points: Sequence[Point],
    tasks: Sequence[Task],
    client: Any,
    workers: int | None,
    say: Callable[[str], None],
) -> Sweep:
    parts = load_parts(folder.parts, tasks)
    done = {number for part in parts for number in part.numbers}
    if len(done) == len(points) and folder.finished:
        table = folder.table.read_text(encoding="utf-8") if folder.table.is_file() else ""
        return Sweep(folder, folder.read_summary(), table, already_finished=True)
    todo = [left for task in tasks if (left := task.without(done)) is not None]
    say(f"{spec.name}: {len(points)} points in {len(tasks)} compiled calls" + _going_on(done))
    for note in unused_keys(point.config for point in points):
        say(note)
    failures: list[str] = []
    reasons: dict[int, str] = {}
    ended = 0
    with Interrupt() as interrupted:
        for task, results, why in _outcomes(todo, client, interrupted, workers):
            ended += 1
            if results is None:
                failures.append(f"{task.title}: {why}")
                reasons |= dict.fromkeys(task.numbers, why)
                say(failures[-1])
                continue
            try:
                save_part(folder.parts, task, results)
            except OSError as error:
                raise _no_room(folder, error, len(done), len(points)) from None
            parts.append(Part(task.numbers, results))
            before = 100 * len(done) // len(points)
            done.update(task.numbers)
            if 100 * len(done) // len(points) > before:
                say(f"  {len(done)} of {len(points)} points")
    if ended < len(todo):
        return Sweep(folder, None, interrupted=True)
    try:
        summary, table = _finish(folder, spec, points, parts, reasons)
    except OSError as error:
        raise _no_room(folder, error, len(done), len(points)) from None
    return Sweep(folder, summary, table, tuple(failures), figures=points[0].config.output.figures)


def _outcomes(
    tasks: Sequence[Task], client: Any, interrupted: Callable[[], bool], workers: int | None
) -> Iterator[Outcome]:
    if client is None:
        return run_here(tasks, interrupted, workers)
    from jffsr.study.sweep.cluster import run_on_cluster

    return run_on_cluster(client, tasks, interrupted)


def _going_on(done: set[int]) -> str:
    return f", {len(done)} of them done already" if done else ""


def _no_room(folder: SweepFolder, error: OSError, done: int, count: int) -> InputError:
    return InputError(
        f"{folder.path}: cannot be written ({error.strerror or error}); {done} of {count} points are finished "
        f"and kept, make room and repeat the command"
    )


def _finish(
    folder: SweepFolder,
    spec: Specification,
    points: Sequence[Point],
    parts: Sequence[Part],
    failures: Mapping[int, str],
) -> tuple[dict[str, Any], str]:
    """Write sweep.nc and table.md, then, where every point is in them, the summary that says so."""
    ordered = sorted(parts, key=lambda part: part.numbers)
    dataset = merged(points, ordered, spec.name, _accuracy(points), failures)
    save_sweep(dataset, folder.result)
    comparisons = compare(dataset, keys_of(dataset))
    write_text(folder.table, markdown(dataset, comparisons))
    summary = summary_of(dataset, spec.name)
    if not failures:
        write_json(folder.summary, summary)
    return summary, markdown(dataset, comparisons, MOST_PRINTED)


def _accuracy(points: Sequence[Point]) -> float:
    """The accuracy that all points share, NaN where it was swept."""
    found = {point.config.objective.accuracy for point in points}
    return found.pop() if len(found) == 1 else float("nan")
