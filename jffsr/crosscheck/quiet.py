"""Importing MJX without its two lines about an accelerator package that is not needed here."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator
from types import ModuleType
from typing import TextIO

HARMLESS_LINES = (
    "Failed to import warp: No module named 'warp'",
    "Failed to import mujoco_warp: No module named 'warp'",
)


class _WithoutLines(io.TextIOBase):
    """Passes whole lines on to another stream, except those in HARMLESS_LINES."""

    def __init__(self, stream: TextIO):
        self._stream = stream
        self._pending = ""

    def write(self, text: str) -> int:
        *lines, self._pending = (self._pending + text).split("\n")
        for line in lines:
            if line not in HARMLESS_LINES:
                self._stream.write(line + "\n")
        return len(text)

    def finish(self) -> None:
        if self._pending not in HARMLESS_LINES:
            self._stream.write(self._pending)
        self._pending = ""


@contextlib.contextmanager
def without_harmless_lines() -> Iterator[None]:
    """Standard output inside the block loses exactly HARMLESS_LINES and nothing else."""
    filtered = _WithoutLines(sys.stdout)
    try:
        with contextlib.redirect_stdout(filtered):
            yield
    finally:
        filtered.finish()


def import_mjx() -> ModuleType:
    """The module mujoco.mjx."""
    if "mujoco.mjx" in sys.modules:
        return sys.modules["mujoco.mjx"]
    with without_harmless_lines():
        from mujoco import mjx
    return mjx
