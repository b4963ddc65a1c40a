"""The runs themselves: each search on each scenario with each seed, kept line by line as they end."""

from __future__ import annotations

import gzip
import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from experiments.benchmarks.machine import describe_machine
from experiments.charging import gradient_charge
from experiments.comparison.profiles import SearchRun
from experiments.comparison.scenarios import Scenario
from experiments.comparison.searches import MEMBERS, STARTS, Search
from jffsr.optimizers.driver import Outcome, run
from jffsr.planning.problem import Problem


def unpack(packed: Path, kept: Path) -> None:
    """Put the runs that stand packed beside the page where they are gone on with, unless some are there already."""
    if packed.is_file() and not kept.is_file():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(gzip.decompress(packed.read_bytes()))


def pack(kept: Path, packed: Path) -> None:
    """Pack the runs beside the page; the same runs give the same bytes."""
    packed.write_bytes(gzip.compress(kept.read_bytes(), mtime=0))


def run_missing(
    kept: Path, scenarios: Sequence[Scenario], searches: Sequence[Search], seeds: Sequence[int], budget: int
) -> None:
    """Append to the file every run that is not in it; the cost of a gradient is measured once a scenario."""
    jax.config.update("jax_enable_x64", True)
    lines = [json.loads(line) for line in kept.read_text().splitlines()] if kept.is_file() else []
    done = {(line["scenario"], line["search"], line["seed"]) for line in lines if "search" in line}
    charges = {line["scenario"]: line["gradient_charge"] for line in lines if "gradient_charge" in line}
    with kept.open("a") as file:

        def keep(line: dict[str, Any]) -> None:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

        if not lines:
            keep({"machine": describe_machine(), "budget": budget, "members": MEMBERS, "starts": STARTS})
        problems = {scenario.name: scenario.problem() for scenario in scenarios}
        # Before any search: a load on the machine later on changes no charge.
        for scenario in scenarios:
            if scenario.name not in charges:
                problem = problems[scenario.name]
                charges[scenario.name] = gradient_charge(problem, MEMBERS, STARTS)
                keep(
                    {
                        "scenario": scenario.name,
                        "about": scenario.about,
                        "free": len(problem.bounds()[0]),
                        "gradient_charge": charges[scenario.name],
                    }
                )
        for scenario in scenarios:
            for search in searches:
                left = [seed for seed in seeds if (scenario.name, search.label, seed) not in done]
                _search(
                    scenario.name, problems[scenario.name], search, left, budget, charges[scenario.name], keep
                )


def _search(name: str, problem: Problem, search: Search, seeds, budget: int, charge: float, keep) -> None:
    phases = search.phases(budget, charge)
    for seed in seeds:
        started = time.perf_counter()
        found = run(phases, problem, jax.random.key(seed), chunk=50)
        seconds = time.perf_counter() - started
        keep(_line(name, search.label, seed, charge, found))
        print(f"{name}, {search.label}, {seed}: {found.best_value:.4g}, {seconds:.1f} s", flush=True)


def _line(scenario: str, search: str, seed: int, charge: float, found: Outcome) -> dict[str, Any]:
    """A run as plain data: the best value where it fell, against the evaluations charged."""
    charged = np.array([r.evaluations + charge * r.gradient_evaluations for r in found.history])
    best = np.array([r.best_value for r in found.history])
    fell = np.concatenate([[True], best[1:] < best[:-1]])
    return {
        "scenario": scenario,
        "search": search,
        "seed": seed,
        "evaluations": found.evaluations,
        "gradients": found.gradient_evaluations,
        "charged_in_all": float(charged[-1]),
        "charged": [round(float(x), 1) for x in charged[fell]],
        "best": [float(f"{x:.6g}") if np.isfinite(x) else None for x in best[fell]],
    }


def read_runs(kept: Path) -> tuple[list[SearchRun], dict[str, Any]]:
    """The runs, and the other lines of the file: the machine, and each scenario's facts by its name."""
    runs, facts = [], {"scenarios": {}}
    for line in map(json.loads, kept.read_text().splitlines()):
        if "search" in line:
            best = np.array([np.inf if x is None else x for x in line["best"]])
            runs.append(
                SearchRun(line["scenario"], line["search"], line["seed"], np.array(line["charged"]), best)
            )
        elif "scenario" in line:
            facts["scenarios"][line["scenario"]] = line
        else:
            facts |= line
    return runs, facts
