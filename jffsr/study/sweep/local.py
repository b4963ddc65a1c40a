"""Tasks computed on this machine: batches in this process, the rest by a few worker processes.

A worker that dies takes one task with it. Workers end when this process does, however that ends: their input closes.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import jffsr
from jffsr.errors import InputError
from jffsr.parallel.cores import available_cores
from jffsr.study.sweep.compute import Results, run_task
from jffsr.study.sweep.tasks import Task

MOST_WORKERS = 4
Outcome = tuple[Task, Results | None, str]
"""A task, its results, or None and in one line why there are none."""


def run_here(
    tasks: Sequence[Task], interrupted: Callable[[], bool], workers: int | None = None
) -> Iterator[Outcome]:
    """The tasks of several points one after another on all devices of this process, then the others by workers."""
    for task in tasks:
        if not task.queued:
            if interrupted():
                return
            yield task, *attempt(task)
    queued = [task for task in tasks if task.queued]
    if queued and not interrupted():
        count = workers or min(MOST_WORKERS, available_cores())
        yield from _by_workers(queued, min(count, len(queued)), interrupted)


def attempt(task: Task) -> tuple[Results | None, str]:
    """The results of a task, or None and why there are none: one that fails is no reason to lose the others."""
    try:
        return run_task(task), ""
    except InputError:
        raise
    except Exception as error:
        told = " ".join(str(error).split())
        return None, f"{type(error).__name__}: {told[:300]}"


def _by_workers(tasks: Sequence[Task], count: int, interrupted: Callable[[], bool]) -> Iterator[Outcome]:
    waiting: queue.SimpleQueue[Task] = queue.SimpleQueue()
    finished: queue.SimpleQueue[Outcome] = queue.SimpleQueue()
    for task in tasks:
        waiting.put(task)
    workers = [_Worker(waiting, finished) for _ in range(count)]
    try:
        left = len(tasks)
        while left and not interrupted():
            try:
                # Woken now and then, so that a signal is seen.
                yield finished.get(timeout=0.5)
            except queue.Empty:
                continue
            left -= 1
    finally:
        for worker in workers:
            worker.stop()


class _Worker:
    """A thread that hands tasks to a process of its own, and starts another where that one dies."""

    def __init__(self, waiting: queue.SimpleQueue, finished: queue.SimpleQueue) -> None:
        self._waiting, self._finished = waiting, finished
        self._process: subprocess.Popen | None = None
        self._stopped = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the process and the thread."""
        with self._lock:
            self._stopped = True
            if self._process is not None:
                self._process.kill()
        self._thread.join()
        if self._process is not None:
            _close(self._process)

    def _serve(self) -> None:
        while not self._stopped:
            try:
                task = self._waiting.get_nowait()
            except queue.Empty:
                return
            found, why = self._ask(task)
            if not self._stopped:
                self._finished.put((task, found, why))

    def _ask(self, task: Task) -> tuple[Results | None, str]:
        with self._lock:
            if self._stopped:
                return None, "stopped"
            if self._process is None:
                self._process = _start()
            process = self._process
        try:
            data = pickle.dumps(task)
            process.stdin.write(len(data).to_bytes(8, "little") + data)
            process.stdin.flush()
            return pickle.load(process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            status = process.wait()
            _close(process)
            with self._lock:
                self._process = None
            end = f"signal {-status}" if status < 0 else f"exit status {status}"
            return None, f"its process ended ({end}); memory may have run out"
        except Exception as error:
            return None, f"{type(error).__name__}: {error}"


def _start() -> subprocess.Popen:
    root = str(Path(jffsr.__file__).parents[1])
    places = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH", "")]))
    return subprocess.Popen(
        [sys.executable, "-m", "jffsr.study.sweep.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": places, "JAX_NUM_CPU_DEVICES": "1"},
    )


def _close(process: subprocess.Popen) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        try:
            pipe.close()
        except OSError:
            continue
