"""A planning study: from a configuration to a plan, in memory or in a run folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from jffsr.errors import InputError
from jffsr.optimizers.registry import Settings
from jffsr.parallel.processes import is_first
from jffsr.planning.plan import Plan, SearchInterrupted, solve
from jffsr.planning.problem import Problem
from jffsr.planning.search import search_of
from jffsr.study.atomic import write_json
from jffsr.study.building import build_problem, build_settings, build_tolerances
from jffsr.study.claiming import Run, claim, shared_summary
from jffsr.study.config import load_config
from jffsr.study.dataset import plan_dataset, save_dataset
from jffsr.study.robust_summary import robust_summary
from jffsr.study.run_folder import RunFolder
from jffsr.study.schema import PlanningConfig
from jffsr.study.searching import kept_search
from jffsr.study.summary import plan_summary
from jffsr.study.unused import unused_keys


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
    if isinstance(config, str | os.PathLike):
        config = load_config(config, overrides)
    elif overrides:
        raise InputError("overrides go with a configuration's path or name, not with a loaded one")
    if not isinstance(config, PlanningConfig):
        call = {"tracking": "jffsr.track", "capture": "jffsr.plan_capture"}.get(config.kind)
        instead = "" if call is None else f", or {call} in Python"
        raise InputError(f"{config.where('kind')}: found '{config.kind}'; use 'jffsr run'{instead}")
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


def run_planning(
    config: PlanningConfig, out: str | Path | None, say: Callable[[str], None] = lambda text: None
) -> Run:
    """Run a planning study in its folder, going on from a checkpoint if there is one.

    The problem is built, and so the input checked, before the folder is touched. Of several processes that compute
    together only the first touches it.
    """
    problem = build_problem(config)
    folder, finished, begun = claim(config, out)
    if finished:
        return Run(folder, shared_summary(folder), already_finished=True)
    for note in unused_keys([config]):
        say(note)
    kind, settings = build_settings(config)
    phases, searched = search_of(problem, kind, settings)
    try:
        with kept_search(
            folder,
            begun,
            phases,
            searched,
            seed=config.seed,
            progress=config.output.progress,
            constrained=bool(problem.constraints),
            say=say,
        ) as hooks:
            found = _solve(config, problem, **hooks)
    except SearchInterrupted:
        return Run(folder, None, interrupted=True)
    # Spread over the devices of all processes, and so a matter of all of them.
    robust = robust_summary(found, config.robust)
    if is_first():
        _finish(folder, config, found, [phase.name for phase in phases], robust)
    return Run(folder, shared_summary(folder))


def _finish(
    folder: RunFolder, config: PlanningConfig, found: Plan, phase_names: list[str], robust: dict[str, Any]
) -> None:
    """Write the arrays, then the summary, which marks the run as finished."""
    save_dataset(plan_dataset(found, config.name, phase_names), folder.result)
    summary = plan_summary(found, config.name, config.seed, build_tolerances(config))
    write_json(folder.summary, summary | robust)
    folder.checkpoint.unlink(missing_ok=True)
