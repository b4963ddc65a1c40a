"""The kinds of study: how one is run, and how its summary reads; a new kind is a line in each table."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jffsr.study.run_folder import RunFolder

if TYPE_CHECKING:
    from jffsr.study.claiming import Run
    from jffsr.study.config import Study

_RUNNERS = {
    "planning": "jffsr.study.planning:run_planning",
    "tracking": "jffsr.study.tracking.running:run_tracking",
    "capture": "jffsr.study.capture.running:run_capture",
    "reactionless": "jffsr.study.reactionless.running:run_reactionless",
    "chain": "jffsr.study.chain.running:run_chain",
}
_TEXTS = {
    "planning": "jffsr.study.summary:summary_text",
    "tracking": "jffsr.study.tracking.summary:summary_text",
    "capture": "jffsr.study.capture.summary:summary_text",
    "reactionless": "jffsr.study.reactionless.summary:summary_text",
    "chain": "jffsr.study.chain.summary:summary_text",
}
_CHECKS = {
    "planning": "jffsr.study.reviewing:check_run",
    "tracking": "jffsr.study.tracking.reviewing:check_tracking",
    "capture": "jffsr.study.capture.reviewing:check_run",
    "reactionless": "jffsr.study.reactionless.reviewing:check_run",
    "chain": "jffsr.study.chain.reviewing:check_run",
}


def run_study(config: Study, out: str | Path | None, say: Callable[[str], None] = lambda text: None) -> Run:
    """Run a study of any kind in its folder; see `run_planning` and its neighbours."""
    return _loaded(_RUNNERS[config.kind])(config, out, say=say)


def summary_text(summary: dict[str, Any]) -> str:
    """A summary of any kind for the terminal."""
    return _loaded(_TEXTS[summary["kind"]])(summary)


def check_study(path: str | Path) -> Any:
    """Re-verify a finished run of any kind in other simulators; its report has `passed` and `to_text`."""
    kind = RunFolder(Path(path)).read_config().kind
    return _loaded(_CHECKS[kind])(path)


def _loaded(name: str) -> Callable:
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)
