"""Reading a text file that nobody has vouched for."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from jffsr.errors import InputError
from jffsr.reading.did_you_mean import hint

MAX_BYTES = 1_000_000

_NOTED: ContextVar[dict[str, bytes] | None] = ContextVar("noted", default=None)


@contextmanager
def what_is_read() -> Iterator[dict[str, bytes]]:
    """Context that yields a mapping in which each file that is read there appears: absolute path, content."""
    noted: dict[str, bytes] = {}
    token = _NOTED.set(noted)
    try:
        yield noted
    finally:
        _NOTED.reset(token)


def read_text(path: Path, shown: str, kind: str = "YAML", most: int = MAX_BYTES) -> str:
    """The UTF-8 text of a regular file of at most `most` bytes, `shown` in messages; raises InputError."""
    data = read_bytes(path, shown, f"a {kind} file", most)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"0x{data[error.start]:02x}"
        raise InputError(f"{shown}:{line}: the file is not UTF-8 text (byte {byte})") from None


def read_bytes(path: Path, shown: str, expected: str, most: int) -> bytes:
    """The content of a regular file of at most `most` bytes; `expected` names it in messages: "a YAML file"."""
    try:
        # Opened first, and without waiting, so that a pipe or a device is refused and never read.
        with open(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise InputError(f"{shown}: this is not a regular file, {expected} is expected")
            data = file.read(most + 1)
    except InputError:
        raise
    except IsADirectoryError:
        raise InputError(f"{shown}: this is a folder, {expected} is expected") from None
    except FileNotFoundError:
        raise InputError(
            f"{shown}: there is no such file{hint(path.name, beside(path, (path.suffix,)))}"
        ) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{shown!r}: the file cannot be read ({reason.lower()})") from None
    if len(data) > most:
        raise InputError(f"{shown}: the file is larger than {most:,} bytes, the most that is read")
    if (noted := _NOTED.get()) is not None:
        noted[os.path.abspath(path)] = data
    return data


def folders_beside(path: Path) -> list[str]:
    """Names of the folders in the place of one that is not there."""
    try:
        return sorted(other.name for other in path.parent.iterdir() if other.is_dir())
    except OSError:
        return []


def beside(path: Path, suffixes: tuple[str, ...]) -> list[str]:
    """Names of the files of these kinds in the folder of a file that is not there."""
    try:
        return sorted(other.name for other in path.parent.iterdir() if other.suffix in suffixes)
    except OSError:
        return []
