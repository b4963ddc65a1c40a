"""Ctrl-C that ends a run at the next chunk, with its checkpoint written."""

from __future__ import annotations

import signal
import sys
import threading
from types import FrameType, TracebackType


class Interrupt:
    """Context manager that turns the first SIGINT or SIGTERM into a flag, and a second into an exit at once.

    Calling it tells whether a signal has come. Outside the main thread, where handlers cannot be set, the
    flag is never raised.
    """

    def __init__(self) -> None:
        self._raised = False
        self._old: dict[int, object] = {}

    def __call__(self) -> bool:
        return self._raised

    def __enter__(self) -> Interrupt:
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._old[number] = signal.signal(number, self._handle)
        return self

    def __exit__(self, kind: type | None, value: BaseException | None, trace: TracebackType | None) -> None:
        for number, old in self._old.items():
            signal.signal(number, old)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self._raised:
            raise KeyboardInterrupt
        self._raised = True
        print("\nstopping after this chunk (again: at once, without a checkpoint)", file=sys.stderr)
