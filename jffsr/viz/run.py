"""The figures of a finished run of any kind, from its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from jffsr.study.capture.schema import CaptureConfig
from jffsr.study.chain.schema import ChainConfig
from jffsr.study.reactionless.schema import ReactionlessConfig
from jffsr.study.reviewing import open_run, open_tracking
from jffsr.study.run_folder import RunFolder
from jffsr.study.tracking.schema import TrackingConfig
from jffsr.viz.save import KINDS, save_figures


def draw_run(path: str | Path, kinds: Sequence[str] = KINDS) -> list[Path]:
    """Draw the figures of a finished run into its folder and return their files; InputError if it is none.

    kinds are of "png" and "pdf".
    """
    config = RunFolder(Path(path)).read_config()
    if isinstance(config, ChainConfig):
        from jffsr.study.chain.reviewing import open_chain
        from jffsr.viz.chain import save_chain_figures

        folder, study, plan, observation, dataset = open_chain(path)
        shown = study.robot, study.geometry, plan, observation, dataset
        return save_chain_figures(*shown, config.hold.base_rate, folder.figures, kinds)
    if isinstance(config, ReactionlessConfig):
        from jffsr.study.reactionless.reviewing import open_runs
        from jffsr.viz.reactionless import save_reactionless_figures

        folder, robot, dataset = open_runs(path)
        return save_reactionless_figures(robot, dataset, config.hold.base_rate, folder.figures, kinds)
    if isinstance(config, CaptureConfig):
        from jffsr.study.capture.reviewing import open_capture
        from jffsr.viz.capture import save_capture_figures

        folder, study, dataset, solutions = open_capture(path)
        return save_capture_figures(study.robot, study.geometry, dataset, solutions, folder.figures, kinds)
    if isinstance(config, TrackingConfig):
        from jffsr.viz.tracking import save_tracking_figures
        from jffsr.viz.tracking_runs import runs_of

        folder, task, dataset = open_tracking(path)
        times = folder.read_summary().get("singularities", {})
        return save_tracking_figures(runs_of(dataset, task.robot, times), folder.figures, kinds)
    folder, problem, dataset = open_run(path)
    return save_figures(problem.robot, dataset, folder.figures, kinds)
