"""A reactionless study in its folder: every run carried out, and what came of it written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from jffsr.parallel.processes import is_first
from jffsr.planning.stopwatch import Stopwatch
from jffsr.study.atomic import write_json
from jffsr.study.claiming import Run, claim, shared_summary
from jffsr.study.dataset import save_dataset
from jffsr.study.reactionless.building import ReactionlessStudy, build_study
from jffsr.study.reactionless.dataset import runs_dataset
from jffsr.study.reactionless.holding import Held, hold_still
from jffsr.study.reactionless.schema import ReactionlessConfig
from jffsr.study.reactionless.schema_hold import Hold
from jffsr.study.reactionless.summary import reactionless_summary, run_summary


def run_reactionless(
    config: ReactionlessConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a reactionless study in its folder; one that was stopped begins anew.

    The study is built, and so the input checked, before the folder is touched.
    """
    study = build_study(config)
    folder, finished, _ = claim(config, out)
    if finished:
        return Run(folder, shared_summary(folder), already_finished=True)
    told = say if config.output.progress else lambda text: None
    folder.metrics.unlink(missing_ok=True)
    runs: dict[str, tuple[Held, ...]] = {}
    with Stopwatch() as watch:
        for name, hold in config.holds.items():
            runs[name] = run_hold(config, study, hold, config.seeds)
            found = run_summary(hold, runs[name])
            told(f"{name}: {found['sentence']}")
            if is_first():
                folder.add_metrics(run=name, **found)
    if is_first():
        save_dataset(runs_dataset(study.robot, runs), folder.result)
        write_json(folder.summary, reactionless_summary(config, study, runs, watch.as_dict()))
    return Run(folder, shared_summary(folder))


def run_hold(
    config: ReactionlessConfig, study: ReactionlessStudy, hold: Hold, seeds: int = 1, in_mujoco: bool = False
) -> tuple[Held, ...]:
    """So many seeds of one run."""
    return hold_still(
        hold,
        study.robot,
        study.compound.robot,
        study.compound.state,
        study.known,
        study.end_effector,
        seeds=seeds,
        strike=study.strike,
        where=config.where("hold"),
        in_mujoco=in_mujoco,
    )
