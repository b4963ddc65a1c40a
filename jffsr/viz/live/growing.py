"""Lines of JSON that another process appends to a file, read as they come."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

_HEAD = 4096


class GrowingLines:
    """The rows of a .jsonl file; `rows` are those that were whole when last looked."""

    def __init__(self, path: Path):
        self._path = path
        self._forget()

    def _forget(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self._read, self._head = 0, b""

    def look(self) -> list[dict[str, Any]]:
        """Read what is new, and return all rows.

        A last line without its end is left for the next look, one that is no mapping is skipped. A file that was cut or
        written anew, as a run does that goes on, is read from its beginning; without the file there are no rows.
        """
        try:
            with open(self._path, "rb") as file:
                # The same file begins as it did.
                if file.read(len(self._head)) != self._head or file.seek(0, 2) < self._read:
                    self._forget()
                file.seek(self._read)
                new = file.read()
                whole = new[: new.rfind(b"\n") + 1]
                self._read += len(whole)
                file.seek(0)
                self._head = file.read(min(_HEAD, self._read))
        except OSError:
            self._forget()
            return self.rows
        for line in whole.splitlines():
            try:
                row = json.loads(line)
            except ValueError:
                continue
            if isinstance(row, dict):
                self.rows.append(row)
        return self.rows
