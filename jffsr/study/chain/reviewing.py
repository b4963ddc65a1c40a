"""A finished chain looked at again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jffsr.study.capture.building import CaptureStudy, build_study
from jffsr.study.chain.running import OBSERVATION, PLAN
from jffsr.study.reviewing import open_result
from jffsr.study.run_folder import RunFolder


def open_chain(path: str | Path) -> tuple[RunFolder, CaptureStudy, Any, Any, Any]:
    """The folder and study of a finished chain, and the datasets of its plan, its observation and its motion.

    InputError where something is missing.
    """
    folder = RunFolder(Path(path))
    study = build_study(folder.read_config())
    plan = open_result(folder, folder.path / PLAN, "criterion")
    observation = open_result(folder, folder.path / OBSERVATION, "angular_velocity")
    return folder, study, plan, observation, open_result(folder, folder.result, "time")
