"""Several processes, on one machine or many, as one: who writes, and what all of them have to agree on."""

from __future__ import annotations

from collections.abc import Callable

import jax
import numpy as np

from jffsr.errors import InputError

# s. A process that has gone takes the others with it, so that all can be started again from the checkpoint.
_TIMEOUTS = {"initialization_timeout": 120, "heartbeat_timeout_seconds": 30, "shutdown_timeout_seconds": 30}


def join_processes(
    coordinator: str | None = None, processes: int | None = None, process: int | None = None
) -> None:
    """Make this process the number `process` of `processes` that compute together; coordinator is HOST:PORT.

    To be called before JAX is first used, in every process. What is not given JAX takes from its own environment
    variables or the cluster that started it. Raises InputError where that cannot be, and where the others do not come.
    """
    jax.config.update("jax_cpu_collectives_implementation", "gloo")
    try:
        jax.distributed.initialize(coordinator, processes, process, **_TIMEOUTS)
    except (RuntimeError, ValueError) as error:
        reason = str(error).strip().splitlines()[0]
        raise InputError(f"the processes cannot be joined: {reason}") from None


def is_first() -> bool:
    """Whether this process is the one that writes and speaks."""
    return jax.process_index() == 0


def from_first(data: bytes) -> bytes:
    """The first process's bytes, in every process; all of them have to call it."""
    if jax.process_count() == 1:
        return data
    from jax.experimental.multihost_utils import broadcast_one_to_all

    length = int(broadcast_one_to_all(np.array(len(data))))
    mine = np.frombuffer(data.ljust(length, b"\0")[:length], dtype=np.uint8)
    return np.asarray(broadcast_one_to_all(mine)).astype(np.uint8).tobytes()


def first_does(action: Callable[[], bytes]) -> bytes:
    """What the action returns in the first process, where alone it is done, in every process.

    An InputError that it raises is raised in every process. All of them have to call it.
    """
    if jax.process_count() == 1:
        return action()
    message = b""
    if is_first():
        try:
            message = b"+" + action()
        except InputError as error:
            message = b"-" + str(error).encode()
    message = from_first(message)
    if message[:1] == b"-":
        raise InputError(message[1:].decode())
    return message[1:]


def any_process(flag: bool) -> bool:
    """Whether the flag is raised in any process; all of them have to call it."""
    if jax.process_count() == 1:
        return flag
    from jax.experimental.multihost_utils import process_allgather

    return bool(np.any(process_allgather(np.array(flag, dtype=np.int32))))
