"""Particle swarm against genetic algorithm as in Hu, Wang and Shi 2011: the table and picture of docs/benchmarks.

The paper's task, index and budget: 25 members, 200 generations, 20 seeds each. Rows: its swarm (inertia 0.7298, both
accelerations 1.4962), its genetic algorithm (20 bits, roulette, crossover 0.8, mutation 0.01 a bit, no elitism), the
same with elitism, and the hybrid, whose gradients are charged at their measured cost.

Run it from the root of the repository: `python -m experiments.hu_2011`. The runs are kept beside the page.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from statistics import median

import jax
import numpy as np

from experiments.benchmarks.machine import describe_machine
from experiments.charging import gradient_charge
from experiments.pages import fill
from jffsr.compiling import jit
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.planning.problem import Problem
from jffsr.study.building import build_problem, build_settings
from jffsr.study.config import load_config

MEMBERS, GENERATIONS = 25, 200
PSO, GA, ELITIST, HYBRID = "PSO", "GA", "GA with elitism", "hybrid"
_BITS = {"bits": 20, "selection": "roulette", "crossover_rate": 0.8, "mutation_rate": 0.01}
_SWARM = {"inertia": 0.7298, "cognitive": 1.4962, "social": 1.4962}
SEARCHES = {
    PSO: ("pso", _SWARM),
    GA: ("ga_binary", {**_BITS, "elitism": False}),
    ELITIST: ("ga_binary", {**_BITS, "elitism": True}),
    HYBRID: ("hybrid", None),
}
GRID = np.unique(np.logspace(np.log10(MEMBERS), np.log10(MEMBERS * GENERATIONS), 60).round())


def main() -> None:
    """Measure, or take what was measured, then write the table into the page and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--searches", default=",".join(SEARCHES), help="names, by commas")
    parser.add_argument("--config", default="hu_2011")
    parser.add_argument("--out", default="docs/benchmarks/hu_2011.md")
    parser.add_argument("--redraw", action="store_true", help="from the runs kept beside --out")
    arguments = parser.parse_args()
    page = Path(arguments.out)
    kept = page.with_suffix(".jsonl")
    if not arguments.redraw:
        jax.config.update("jax_enable_x64", True)
        page.parent.mkdir(parents=True, exist_ok=True)
        with kept.open("w") as file:
            for line in measured(arguments.config, arguments.searches.split(","), arguments.seeds):
                file.write(json.dumps(line) + "\n")
                file.flush()
    facts, *rows = [json.loads(line) for line in kept.read_text().splitlines()]
    fill(page, table(facts, rows), "Minimum torque: swarm against genes")
    draw(rows, page.with_suffix(".png"))


def measured(config_name: str, names: list[str], seeds: int):
    """What holds for all runs, then the runs one by one, as mappings."""
    config = load_config(config_name)
    problem, (_, own) = build_problem(config), build_settings(config)
    charge = gradient_charge(problem, own.particles, own.starts)
    yield {"machine": describe_machine(), "gradient_cost": charge, "free": len(problem.bounds()[0])}
    for name in names:
        kind, options = SEARCHES[name]
        settings = own
        if options is not None:
            settings = Settings(particles=MEMBERS, evaluations=MEMBERS * GENERATIONS, options=options)
        phases = build_phases(kind, settings)
        for seed in range(seeds):
            started = time.perf_counter()
            found = run(phases, problem, jax.random.key(seed), chunk=50)
            print(
                f"{name}, {seed}: {found.best_value:.6g}, {time.perf_counter() - started:.1f} s", flush=True
            )
            yield _row(name, seed, charge, problem, found)


def _row(name: str, seed: int, charge: float, problem: Problem, found: Outcome) -> dict:
    charged = np.array([r.evaluations + charge * r.gradient_evaluations for r in found.history])
    best = np.array([r.best_value for r in found.history])
    # The best so far on a grid that all runs share; null before the first evaluation is in.
    last = np.searchsorted(charged, GRID, side="right") - 1
    integral, penalty, rate, acceleration = (float(x) for x in _facts(problem, found.best_position))
    near = charged[np.flatnonzero(best <= 1.01 * best[-1])[0]]
    return {
        "search": name,
        "seed": seed,
        "J": found.best_value,
        "torque_integral": integral,
        "angle_deg": float(np.rad2deg(np.sqrt(penalty))),
        "peak_rate": rate,
        "peak_acceleration": acceleration,
        "evaluations": found.evaluations,
        "gradients": found.gradient_evaluations,
        "charged": round(float(charged[-1]), 1),
        "charged_to_near_end": round(float(near), 1),
        "curve": [float(f"{best[i]:.5g}") if i >= 0 and np.isfinite(best[i]) else None for i in last],
    }


@jit
def _facts(problem: Problem, free):
    """Torque integral, squared final angle, peak rate and acceleration of a candidate."""
    motion = problem.motion(free)
    terms = problem.objective.breakdown(problem.robot, motion)
    grid = motion.joint_grid
    peaks = (abs(x).max() for x in (grid.joint_velocity, grid.joint_acceleration))
    return terms["torque_integral"].value, terms["attitude_penalty"].value, *peaks


def table(facts: dict, rows: list[dict]) -> str:
    """One line a search: the spread of the index over the seeds, what it is made of, and what it cost."""
    machine = facts["machine"]
    seeds = len({row["seed"] for row in rows})
    lines = [
        f"{seeds} seeds, {facts['free']} free numbers, a gradient charged {facts['gradient_cost']:.2f} evaluations; "
        f"{machine['processor']}, {machine['cores']} cores, JAX {machine['versions']['jax']}. Medians over the seeds "
        "but where said; the last column is the evaluations charged until J is within 1 % of where that run ends.",
        "",
        "| search | J median | quartiles | best | worst | torque integral [N m s] | abs. final angle [deg] | peak rate "
        "[rad/s] | peak acceleration [rad/s^2] | charged | within 1 % after |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name in SEARCHES:
        group = [row for row in rows if row["search"] == name]
        if not group:
            continue
        index = [row["J"] for row in group]
        low, high = np.percentile(index, (25, 75))
        middle = {
            key: median(row[key] for row in group) for key in group[0] if key not in ("search", "curve")
        }
        cells = [
            name,
            f"{middle['J']:.5g}",
            f"{low:.5g} to {high:.5g}",
            f"{min(index):.5g}",
            f"{max(index):.5g}",
            f"{middle['torque_integral']:.4g}",
            f"{middle['angle_deg']:.2g}",
            f"{middle['peak_rate']:.3g}",
            f"{middle['peak_acceleration']:.3g}",
            f"{middle['charged']:,.0f}",
            f"{middle['charged_to_near_end']:,.0f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    medians = {name: [r["J"] for r in rows if r["search"] == name] for name in (PSO, GA)}
    if all(medians.values()):
        ratio = median(medians[PSO]) / median(medians[GA])
        lines += [
            "",
            f"Median J of PSO over that of GA: {ratio:.3f}; printed, of one run each: 1.12e6/1.79e6 = 0.626.",
        ]
    return "\n".join(lines)


def draw(rows: list[dict], path: Path) -> None:
    """Best index so far against evaluations charged: median and quartile band of each search."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    # Each with its own line, so that they are told apart in grey as well.
    styles = {
        PSO: ("#b03a5b", "-."),
        GA: ("#7a7a7a", ":"),
        ELITIST: ("#c79a00", "--"),
        HYBRID: ("#00204d", "-"),
    }
    figure, axes = plt.subplots(figsize=(7, 4.2), constrained_layout=True)
    for name, (colour, line) in styles.items():
        group = [row for row in rows if row["search"] == name]
        if not group:
            continue
        values = np.array([[np.nan if v is None else v for v in row["curve"]] for row in group])
        # To the first point of the grid where all have ended, from the first where all have begun.
        end = GRID[min(np.searchsorted(GRID, max(row["charged"] for row in group)), GRID.size - 1)]
        shown = ~np.isnan(values).any(axis=0) & (GRID <= end)
        low, middle, high = np.percentile(values[:, shown], (25, 50, 75), axis=0)
        axes.fill_between(GRID[shown], low, high, color=colour, alpha=0.18, linewidth=0)
        axes.plot(GRID[shown], middle, color=colour, linestyle=line, linewidth=2, label=name)
    axes.set(xscale="log", yscale="log", xlim=(GRID[0], GRID[-1]))
    axes.set_xlabel("evaluations of the objective, gradients charged at their cost")
    axes.set_ylabel("best J so far [N m s]: median, quartiles")
    axes.set_title(f"Minimum torque, planar arm, {len({row['seed'] for row in rows})} seeds", fontsize=11)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=130)
    plt.close(figure)


if __name__ == "__main__":
    main()
