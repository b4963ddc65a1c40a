"""A planning study: from a configuration to a plan, in memory or in a run folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from jffsr.errors import InputError
from jffsr.optimizers.constraints import split
from jffsr.optimizers.driver import Snapshot
from jffsr.optimizers.registry import Settings
from jffsr.parallel.processes import any_process, first_does, is_first
from jffsr.planning.plan import Plan, SearchInterrupted, solve
from jffsr.planning.problem import Problem
from jffsr.planning.search import search_of
from jffsr.study.atomic import write_json
from jffsr.study.building import build_problem, build_settings, build_tolerances
from jffsr.study.checkpoint import load_checkpoint, save_checkpoint
from jffsr.study.config import load_config
from jffsr.study.dataset import plan_dataset, save_dataset
from jffsr.study.interrupt import Interrupt
from jffsr.study.progress import progress_bar
from jffsr.study.robust_summary import robust_summary
from jffsr.study.run_folder import RunFolder, claim_run_folder
from jffsr.study.schema import PlanningConfig
from jffsr.study.summary import plan_summary


def plan(
    config: str | os.PathLike[str] | PlanningConfig | Problem,
    overrides: Sequence[str] = (),
    *,
    optimizer: str = "hybrid",
    settings: Settings | None = None,
    seed: int = 0,
) -> Plan:
    """Plan a motion: the same search and verification as `jffsr run`, returned instead of written.

    config is a path, a name under `configs/`, a loaded configuration, or a Problem built in Python; only for
    a Problem are optimizer, settings and seed read. Raises InputError where the input is at fault, and where
    64-bit floats are off though the configuration does not ask for precision: float32.
    """
    if isinstance(config, Problem):
        return solve(config, optimizer, settings, seed=seed)
    if not isinstance(config, PlanningConfig):
        config = load_config(config, overrides)
    elif overrides:
        raise InputError("overrides go with a configuration's path or name, not with a loaded one")
    return _solve(config, build_problem(config))


def _solve(config: PlanningConfig, problem: Problem, **hooks: Any) -> Plan:
    kind, settings = build_settings(config)
    return solve(
        problem,
        kind,
        settings,
        seed=config.seed,
        chunk=config.optimizer.chunk,
        step_factor=config.verification.step_factor,
        tolerances=build_tolerances(config),
        precision=config.precision,
        with_sensitivity=config.verification.sensitivity,
        **hooks,
    )


@dataclass(frozen=True)
class Run:
    """How a run in a folder ended: its folder, its summary, and whether it was only interrupted."""

    folder: RunFolder
    summary: dict[str, Any] | None
    interrupted: bool = False
    already_finished: bool = False


def run_planning(
    config: PlanningConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a planning study in its folder, going on from a checkpoint if there is one.

    The problem is built, and so the input checked, before the folder is touched. Of several processes that compute
    together only the first touches it.
    """
    problem = build_problem(config)
    folder, finished, begun = _claim(config, out)
    if finished:
        return Run(folder, _summary(folder), already_finished=True)
    kind, settings = build_settings(config)
    phases, searched = search_of(problem, kind, settings)
    resume = None
    if begun:
        resume = load_checkpoint(folder.checkpoint, phases, searched, jax.random.key(config.seed))
        say(f"going on from {folder.checkpoint} ({resume.history[-1].evaluations} evaluations done)")
    if is_first():
        done = resume.history[-1] if resume else None
        folder.keep_metrics(done.evaluations if done else 0, done.gradient_evaluations if done else 0)
    show, close = progress_bar(phases, config.output.progress and is_first(), bool(problem.constraints))

    def on_chunk(snapshot: Snapshot) -> None:
        last = snapshot.history[-1]
        if is_first():
            folder.add_metrics(
                phase=phases[snapshot.phase].name,
                iteration=last.iteration,
                evaluations=last.evaluations,
                gradient_evaluations=last.gradient_evaluations,
                **_best(problem, last.best_value, snapshot.state.progress.best_position.dtype),
            )
        save_checkpoint(folder.checkpoint, snapshot)
        show(snapshot)

    with Interrupt() as interrupted:
        try:
            found = _solve(
                config,
                problem,
                resume=resume,
                on_chunk=on_chunk,
                interrupted=lambda: any_process(interrupted()),
            )
        except SearchInterrupted:
            return Run(folder, None, interrupted=True)
        finally:
            close()
    # Spread over the devices of all processes, and so a matter of all of them.
    robust = robust_summary(found, config.robust)
    if is_first():
        _finish(folder, config, found, [phase.name for phase in phases], robust)
    return Run(folder, _summary(folder))


def _best(problem: Problem, found: float, dtype: Any) -> dict[str, float]:
    """The best index so far, and where there are constraints how far they are missed."""
    if not problem.constraints:
        return {"best_value": found}
    value, violation = split(found, dtype)
    return {"best_value": float(value), "violation": float(violation)}


def _claim(config: PlanningConfig, out: str | Path | None) -> tuple[RunFolder, bool, bool]:
    """The folder of the run, whether the run is finished, and whether it is begun."""

    def claim() -> bytes:
        folder = claim_run_folder(config, out)
        return json.dumps([str(folder.path), folder.finished, folder.checkpoint.is_file()]).encode()

    path, finished, begun = json.loads(first_does(claim))
    return RunFolder(Path(path)), finished, begun


def _summary(folder: RunFolder) -> dict[str, Any]:
    return json.loads(first_does(lambda: json.dumps(folder.read_summary()).encode()))


def _finish(
    folder: RunFolder, config: PlanningConfig, found: Plan, phase_names: list[str], robust: dict[str, Any]
) -> None:
    """Write the arrays, then the summary, which marks the run as finished."""
    save_dataset(plan_dataset(found, config.name, phase_names), folder.result)
    summary = plan_summary(found, config.name, config.seed, build_tolerances(config))
    write_json(folder.summary, summary | robust)
    folder.checkpoint.unlink(missing_ok=True)
