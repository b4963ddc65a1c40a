"""A capture study in its folder: planned, and what came of it written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jffsr.parallel.processes import is_first
from jffsr.planning.stopwatch import Stopwatch
from jffsr.study.atomic import write_json
from jffsr.study.capture.building import CaptureStudy, build_study
from jffsr.study.capture.dataset import capture_dataset, solution_dataset
from jffsr.study.capture.planned import PlannedCapture, plan_study
from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.capture.summary import capture_summary
from jffsr.study.claiming import Run, claim, shared_summary
from jffsr.study.dataset import save_dataset
from jffsr.study.run_folder import RunFolder

FRONT = "front"
"""The folder of the front's chosen solutions, NAME.nc each."""


def run_capture(
    config: CaptureConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a capture study in its folder; one that was stopped begins anew, with its compiled programs at hand.

    The study is built, and so the input checked, before the folder is touched.
    """
    study = build_study(config)
    folder, finished, _ = claim(config, out)
    if finished:
        return Run(folder, shared_summary(folder), already_finished=True)
    told = say if config.output.progress else lambda text: None
    with Stopwatch() as watch:
        found = plan_study(config, study, told)
    if is_first():
        _finish(folder, config, study, found, watch)
    return Run(folder, shared_summary(folder))


def _finish(
    folder: RunFolder, config: CaptureConfig, study: CaptureStudy, found: PlannedCapture, watch: Stopwatch
) -> None:
    """Write the arrays, then the summary, which marks the run as finished."""
    summary = capture_summary(config, study, found, watch.as_dict())
    folder.metrics.unlink(missing_ok=True)
    folder.add_metrics(**{key: summary[key] for key in ("attempts", "evaluations", "cost_before", "cost")})
    if found.front is not None:
        (folder.path / FRONT).mkdir(exist_ok=True)
        for name, number in found.front.chosen.items():
            dataset = solution_dataset(config, study, found, found.front.plans[number])
            save_dataset(dataset, folder.path / FRONT / f"{name}.nc")
    save_dataset(capture_dataset(config, study, found), folder.result)
    write_json(folder.summary, summary)
