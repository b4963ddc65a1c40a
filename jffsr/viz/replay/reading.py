"""The replays of a finished run of any kind, from its folder; a new kind is a line in the table."""

from __future__ import annotations

import importlib
from pathlib import Path

from jffsr.study.run_folder import RunFolder
from jffsr.viz.replay.momenta import with_one_scale
from jffsr.viz.replay.replay import Replay

_READERS = {
    "planning": "of_plan:planned_replays",
    "tracking": "of_tracking:tracked_replays",
    "capture": "of_capture:captured_replays",
    "reactionless": "of_hold:held_replays",
    "chain": "of_capture:chained_replays",
}


def replays_of(path: str | Path) -> list[Replay]:
    """What moved in a run: one replay, or one for each tracker or controller that the run compared.

    Raises InputError where the folder holds no finished run, or a run in which nothing moved.
    """
    path = Path(path)
    folder = RunFolder(path)
    kind = folder.read_config().kind
    folder.read_summary()
    module, _, function = _READERS[kind].partition(":")
    return with_one_scale(getattr(importlib.import_module(f"jffsr.viz.replay.{module}"), function)(path))
