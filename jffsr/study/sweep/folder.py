"""The folder of a sweep.

config.yaml and robot/ (enough to repeat it), parts/ (finished results, see `parts`), and at the end sweep.nc, table.md,
figures/ and summary.json, whose presence says that the sweep is finished.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from jffsr.errors import InputError
from jffsr.study.atomic import write_text
from jffsr.study.robot_files import robot_files
from jffsr.study.run_folder import free_name
from jffsr.study.sweep.specification import Specification


class SweepFolder:
    """Paths of a sweep's folder."""

    def __init__(self, path: Path):
        self.path = path
        self.config = path / "config.yaml"
        self.parts = path / "parts"
        self.result = path / "sweep.nc"
        self.table = path / "table.md"
        self.summary = path / "summary.json"
        self.figures = path / "figures"

    @property
    def finished(self) -> bool:
        """Whether every point is in sweep.nc."""
        return self.summary.is_file()

    def read_summary(self) -> dict[str, Any]:
        """The summary of a finished sweep."""
        try:
            return json.loads(self.summary.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise InputError(f"{self.path}: not a finished sweep (no summary.json)") from None
        except (OSError, ValueError) as error:
            raise InputError(f"{self.summary}: cannot be read ({error})") from None

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """Context in which no other process works in the folder; InputError where one does.

        The lock is the system's, which takes it back from whoever dies.
        """
        try:
            import fcntl
        except ImportError:  # no such lock on Windows
            yield
            return
        with _opened(self.path / ".lock") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(f"{self.path}: another process is at work on this sweep") from None
            except OSError:
                pass  # a file system without locks
            yield


def _opened(path: Path) -> BinaryIO:
    try:
        return open(path, "wb")
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None


def claim_sweep_folder(spec: Specification, out: str | Path | None) -> SweepFolder:
    """The folder of this sweep: a new one, or the one to go on in; the first free of runs/NAME, ... without `out`.

    InputError where `out` belongs to something else, or cannot be written.
    """
    folder = SweepFolder(free_name(Path("runs"), spec.name) if out is None else Path(out))
    carried = robot_files(spec.robots)
    path, text = folder.path, spec.to_yaml(carried.names)
    # A kill while the configuration is written leaves nothing but hidden files.
    if path.is_dir() and any(not item.name.startswith(".") for item in path.iterdir()):
        if not folder.config.is_file():
            raise InputError(f"--out {path}: the folder is not empty and holds no sweep; give another")
        if folder.config.read_text(encoding="utf-8") != text:
            raise InputError(
                f"--out {path}: the folder holds another sweep or a run; give another folder, or go on with "
                f"'jffsr sweep {folder.config} --out {path}'"
            )
    try:
        path.mkdir(parents=True, exist_ok=True)
        if not folder.config.is_file():
            write_text(folder.config, text)
        carried.write(path)
        folder.parts.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(f"--out {path}: cannot be written ({error.strerror or error})") from None
    return folder
