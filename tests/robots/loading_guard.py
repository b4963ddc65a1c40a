"""Loading a file that may be damaged: within a time, and with the message of a refusal at hand."""

from __future__ import annotations

import contextlib
import signal
from pathlib import Path

import jffsr
from jffsr.errors import InputError

SECONDS = 5.0


@contextlib.contextmanager
def within(seconds: float):
    """Fail what takes longer: a hang is told, not waited for."""

    def stop(number, frame):
        raise TimeoutError(f"took over {seconds} s")

    old = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)


def attempt(path: Path):
    """The robot and no message, or no robot and the message of the refusal; whatever else is raised passes."""
    try:
        with within(SECONDS):
            return jffsr.load_robot(path), ""
    except InputError as error:
        return None, str(error)
