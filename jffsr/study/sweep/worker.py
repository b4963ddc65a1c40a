"""A process that computes tasks for a sweep: pickled tasks come in on standard input, results go out on the output."""

from __future__ import annotations

import os
import pickle
import queue
import signal
import sys
import threading
from typing import BinaryIO


def main() -> None:
    """Serve until the input closes, at once also in the middle of a task: nobody would take its results."""
    # Ctrl-C reaches the whole group; it is for the process that handed out the tasks.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    replies = os.fdopen(os.dup(1), "wb")
    # Whatever a user's own term prints would end up among the results.
    os.dup2(2, 1)
    tasks: queue.SimpleQueue = queue.SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, tasks), daemon=True).start()

    import jax

    from jffsr.compiling.keeping import keep_programs
    from jffsr.study.sweep.local import attempt

    jax.config.update("jax_enable_x64", True)
    keep_programs()
    while True:
        try:
            reply = attempt(pickle.loads(tasks.get()))
        except Exception as error:
            reply = None, f"{type(error).__name__}: {error}"
        pickle.dump(reply, replies)
        replies.flush()


def _read(source: BinaryIO, tasks: queue.SimpleQueue) -> None:
    """Pass on each task, still pickled, behind whose length in 8 bytes it comes."""
    while True:
        length = source.read(8)
        if len(length) < 8:
            os._exit(0)
        tasks.put(source.read(int.from_bytes(length, "little")))


if __name__ == "__main__":
    main()
