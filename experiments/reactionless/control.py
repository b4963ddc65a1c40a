"""Tracking after capture as in Ye, Dong and Hong 2019: tables and figures of docs/benchmarks/reactionless_control.md.

PD, the extreme learning machine with random, PSO-tuned and SSADE-tuned input weights, computed torque and the
passivity-based adaptive law on the published case, each over the same seeds. What was measured is kept beside the page.

Run it from the root of the repository: `python -m experiments.reactionless.control`.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import jax

from experiments.benchmarks.machine import describe_machine
from experiments.pages import fill
from experiments.reactionless.control_page import draw_errors, draw_momentum, tables
from experiments.reactionless.control_runs import (
    CONTROLLERS,
    HIT,
    SCENES,
    SIMULATION,
    SSADE,
    STROKE,
    by_period,
    curves,
    integral_gains,
    loops,
    machines,
    numbers,
    on_mujoco,
    training_values,
)

PERIODS = (0.04, 0.02, 0.01, 0.005, 0.0025)


def main() -> None:
    """Measure, or take what was measured, then write the tables into the page and draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--evaluations", type=int, default=3000, help="of each search, in generations of 30")
    parser.add_argument("--machines", type=Path, help="file that keeps the weights that the searches found")
    parser.add_argument("--out", default="docs/benchmarks/reactionless_control.md")
    parser.add_argument("--redraw", action="store_true", help="from what is kept beside --out")
    arguments = parser.parse_args()
    page = Path(arguments.out)
    kept = page.with_suffix(".jsonl")
    if not arguments.redraw:
        jax.config.update("jax_enable_x64", True)
        lines = measured(arguments.seeds, arguments.evaluations, arguments.machines)
        kept.write_text("".join(json.dumps(line) + "\n" for line in lines))
    facts, shown, *rows = [json.loads(line) for line in kept.read_text().splitlines()]
    fill(page, tables(facts, rows), "Tracking after capture")
    draw_errors(shown, page.with_name("reactionless_control_errors.png"))
    draw_momentum(shown, page.with_name("reactionless_control_momentum.png"))


def measured(seeds: int, evaluations: int, kept: Path | None) -> list[dict]:
    """What holds for all, the curves that are shown, and a mapping for each controller, scene and seed."""
    weights = machines(seeds, evaluations, kept)
    rows, shown, facts = [], {}, {"seeds": seeds, "evaluations": evaluations, "machine": describe_machine()}
    for scene in SCENES:
        for name in CONTROLLERS:
            run = loops(name, weights, scene, seeds)
            rows += [{"scene": scene, "controller": name, **line} for line in numbers(run)]
            print(scene, name, rows[-1]["rms"], flush=True)
            if scene == SIMULATION or (name == SSADE and scene in (STROKE, HIT)):
                shown[f"{scene}/{name}"] = curves(run)
            if (scene, name) == (SIMULATION, SSADE):
                facts["mujoco"] = on_mujoco(weights, run)
    facts["training"] = training_values(weights)
    facts["gain"] = integral_gains(weights)
    facts["periods"] = list(by_period(PERIODS))
    return [facts, shown, *rows]


if __name__ == "__main__":
    main()
