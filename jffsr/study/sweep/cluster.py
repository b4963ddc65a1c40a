"""Tasks computed by the workers of a dask cluster, which hands those of a lost worker to another."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from jffsr.errors import InputError
from jffsr.study.sweep.compute import Results, run_task
from jffsr.study.sweep.local import Outcome
from jffsr.study.sweep.tasks import Task

_PATIENCE = 5
"""s, in which a scheduler must answer."""


def connect(address: str) -> Any:
    """A client of the scheduler at `address`; InputError, within seconds, where there is none."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "--scheduler needs dask.distributed: install it with pip install 'jffsr[cluster]'"
        ) from None
    # The library tells of every failed attempt; one sentence will do.
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.comm", "tornado", "asyncio")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        return Client(address, timeout=_PATIENCE, name="jffsr-sweep", set_as_default=False)
    except Exception as error:
        told = " ".join(str(error).split())[:150] or type(error).__name__
        raise InputError(
            f"--scheduler {address}: no scheduler answers there ({told}); start one with 'dask scheduler' and give "
            f"its address"
        ) from None
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def run_on_cluster(client: Any, tasks: Sequence[Task], interrupted: Callable[[], bool]) -> Iterator[Outcome]:
    """The tasks as the workers finish them; what was not begun is taken back at an interrupt."""
    from distributed import as_completed

    futures = {}
    for task in tasks:
        future = client.submit(compute, task, pure=False, key=f"jffsr-{task.numbers[0]}-{id(client)}")
        futures[future.key] = (task, future)
    try:
        with client.as_current():
            done = as_completed([future for _, future in futures.values()])
        for future in done:
            task, _ = futures.pop(future.key)
            error = future.exception()
            if error is not None:
                told = " ".join(str(error).split())[:300]
                yield task, None, f"{type(error).__name__}: {told}"
            else:
                yield task, future.result(), ""
            # Else the scheduler would keep what is on the disk by now.
            future.release()
            if interrupted():
                return
    finally:
        client.cancel([future for _, future in futures.values()])


def compute(task: Task) -> Results:
    """A task on a worker, with the programs that this machine has kept."""
    import jax

    from jffsr.compiling.keeping import keep_programs

    if jax.config.jax_compilation_cache_dir is None:
        keep_programs()
    return run_task(task)
