"""How a run ends, and whose its folder is where several processes compute together."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jffsr.parallel.processes import first_does
from jffsr.study.config import Study
from jffsr.study.run_folder import RunFolder, claim_run_folder


@dataclass(frozen=True)
class Run:
    """How a run in a folder ended: its folder, its summary, and whether it was only interrupted."""

    folder: RunFolder
    summary: dict[str, Any] | None
    interrupted: bool = False
    already_finished: bool = False


def claim(config: Study, out: str | Path | None) -> tuple[RunFolder, bool, bool]:
    """The folder of the run, whether the run is finished, and whether it is begun; the first process claims it."""

    def first_claims() -> bytes:
        folder = claim_run_folder(config, out)
        return json.dumps([str(folder.path), folder.finished, folder.checkpoint.is_file()]).encode()

    path, finished, begun = json.loads(first_does(first_claims))
    return RunFolder(Path(path)), finished, begun


def shared_summary(folder: RunFolder) -> dict[str, Any]:
    """The summary that the first process has written."""
    return json.loads(first_does(lambda: json.dumps(folder.read_summary()).encode()))
