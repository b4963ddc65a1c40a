"""Swarm, gradients and both on the composite-index scenarios: the table and picture of docs/benchmarks.

Every method of a scenario searches the same free numbers, in the same box (doubled in one row), and is scored
on the published index. Evaluations are charged: one a candidate for an objective, and for a gradient the
measured ratio of its time to that of an objective, each in batches of the size that the search uses.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import jax
import numpy as np

from experiments.charging import gradient_charge
from experiments.pages import fill
from jffsr.errors import InputError
from jffsr.optimizers.driver import Outcome, run
from jffsr.optimizers.registry import Settings, build_phases
from jffsr.study.building import build_problem, build_settings
from jffsr.study.config import load_config

SCENARIOS = ("composite_wu6", "composite_wu6_tight", "composite_wu6_momentum", "composite_7dof")
REFUSED = "composite_wu6_impossible"
QPSO, QPSO_WIDE, HYBRID, GRADIENT = "QPSO", "QPSO, box doubled", "hybrid", "gradient"
METHODS = (QPSO, QPSO_WIDE, HYBRID, GRADIENT)
SWARM = Settings(particles=50, evaluations=20_000, target=None)
CURVE_GRID = np.unique(np.logspace(1, np.log10(20_000), 70).round())


def main() -> None:
    """Measure, or take what was measured, then write the table into the page and draw the picture."""
    arguments = _arguments()
    page = Path(arguments.out)
    runs_file = page.with_suffix(".jsonl")
    if not arguments.redraw:
        jax.config.update("jax_enable_x64", True)
        page.parent.mkdir(parents=True, exist_ok=True)
        with runs_file.open("w") as file:
            for name in arguments.scenarios.split(","):
                for row in _measured(name, arguments):
                    file.write(json.dumps(row) + "\n")
                    file.flush()
    rows = [json.loads(line) for line in runs_file.read_text().splitlines()]
    fill(page, _table(rows), "Planning benchmark")
    if any(row["scenario"] == SCENARIOS[0] for row in rows):
        _draw([row for row in rows if row["scenario"] == SCENARIOS[0]], page.with_suffix(".png"))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--scenarios", default=",".join(SCENARIOS), help="names, by commas")
    parser.add_argument("--starts", type=int, default=8, help="starts of the gradient alone")
    parser.add_argument("--evaluations", type=int, default=SWARM.evaluations, help="of the swarm alone")
    parser.add_argument("--out", default="docs/benchmarks/planning.md")
    parser.add_argument("--redraw", action="store_true", help="from the runs kept beside --out")
    return parser.parse_args()


def _measured(name: str, arguments: argparse.Namespace):
    """All runs of one scenario, one mapping each."""
    config = load_config(name)
    problem, (_, settings) = build_problem(config), build_settings(config)
    wide = build_problem(load_config(name, [f"trajectory.box={2 * config.trajectory.box!r}"]))
    swarm = replace(SWARM, evaluations=arguments.evaluations)
    alone = replace(settings, starts=arguments.starts, target=None)
    searches = {
        QPSO: (problem, "qpso", swarm),
        QPSO_WIDE: (wide, "qpso", swarm),
        HYBRID: (problem, "hybrid", replace(settings, target=None)),
        GRADIENT: (problem, "gradient", alone),
    }
    zero = np.zeros(problem.bounds()[0].shape)
    print(f"{name}: J of zero coefficients {float(problem.value(zero)):.4g}", flush=True)
    for method, (searched, kind, chosen) in searches.items():
        ratio = gradient_charge(problem, chosen.particles, chosen.starts) if kind != "qpso" else 0.0
        if ratio:
            print(f"{name}, {method}: a gradient costs {ratio:.2f} objective evaluations", flush=True)
        phases = build_phases(kind, chosen)
        for seed in range(arguments.seeds):
            started = time.perf_counter()
            outcome = run(phases, searched, jax.random.key(seed), chunk=100 if kind == "qpso" else 30)
            row = _row(name, method, seed, ratio, outcome)
            seconds = time.perf_counter() - started
            print(f"{name}, {method}, {seed}: {row['J']:.4g}, {seconds:.1f} s", flush=True)
            yield row


def _row(name: str, method: str, seed: int, ratio: float, outcome: Outcome) -> dict:
    charged = np.array([r.evaluations + ratio * r.gradient_evaluations for r in outcome.history])
    best = np.array([r.best_value for r in outcome.history])
    met = np.flatnonzero(best <= 1.0)
    row = {
        "scenario": name,
        "method": method,
        "seed": seed,
        "J": outcome.best_value,
        "evaluations": outcome.evaluations,
        "gradients": outcome.gradient_evaluations,
        "gradient_cost": round(ratio, 3),
        "charged": round(float(charged[-1]), 1),
        "charged_to_1": round(float(charged[met[0]]), 1) if met.size else None,
    }
    if name == SCENARIOS[0]:
        # The best so far, on a grid that all runs share; null before the first evaluation is in.
        last = np.searchsorted(charged, CURVE_GRID, side="right") - 1
        row["curve"] = [float(f"{best[i]:.4g}") if i >= 0 and np.isfinite(best[i]) else None for i in last]
    return row


def _table(rows: list[dict]) -> str:
    lines = [
        "| scenario | method | J median | J worst | evaluations | gradients | a gradient costs | charged | "
        "charged to J <= 1 | share J <= 1 |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for scenario in dict.fromkeys(row["scenario"] for row in rows):
        for method in METHODS:
            group = [r for r in rows if (r["scenario"], r["method"]) == (scenario, method)]
            if not group:
                continue
            index = [r["J"] for r in group]
            reached = [r["charged_to_1"] for r in group if r["charged_to_1"] is not None]
            cells = [
                scenario,
                method,
                _number(median(index)),
                _number(max(index)),
                f"{median(r['evaluations'] for r in group):,.0f}",
                f"{median(r['gradients'] for r in group):,.0f}",
                f"{group[0]['gradient_cost']:.2f}" if group[0]["gradient_cost"] else "",
                f"{median(r['charged'] for r in group):,.0f}",
                f"{median(reached):,.0f}" if reached else "none",
                f"{len(reached)}/{len(group)}",
            ]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", _refusal()])


def _number(value: float) -> str:
    return "< 1e-9" if value < 1e-9 else f"{value:.3g}"


def _refusal() -> str:
    try:
        build_problem(load_config(REFUSED))
    except InputError as error:
        return f"`{REFUSED}` is refused before any search:\n\n> {error}"
    raise AssertionError(f"{REFUSED} was not refused")


def _draw(rows: list[dict], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    # Dark to light, each with its own line, so that the four are told apart in grey as well.
    styles = {
        QPSO: ("#7a7a7a", ":"),
        QPSO_WIDE: ("#c79a00", "--"),
        HYBRID: ("#00204d", "-"),
        GRADIENT: ("#b03a5b", "-."),
    }
    floor = 1e-6
    figure, axes = plt.subplots(figsize=(7, 4.2), constrained_layout=True)
    for method, (colour, line) in styles.items():
        curves = [row["curve"] for row in rows if row["method"] == method]
        if not curves:
            continue
        values = np.array([[np.nan if v is None else max(v, floor) for v in curve] for curve in curves])
        # Quartiles only where every seed has a value, and to the first point of the grid where all have ended.
        longest = max(row["charged"] for row in rows if row["method"] == method)
        end = CURVE_GRID[min(np.searchsorted(CURVE_GRID, longest), CURVE_GRID.size - 1)]
        shown = ~np.isnan(values).any(axis=0) & (CURVE_GRID <= end)
        low, middle, high = np.percentile(values[:, shown], (25, 50, 75), axis=0)
        axes.fill_between(CURVE_GRID[shown], low, high, color=colour, alpha=0.18, linewidth=0)
        axes.plot(CURVE_GRID[shown], middle, color=colour, linestyle=line, linewidth=2, label=method)
    axes.axhline(1.0, color="black", linewidth=0.8)
    axes.text(12, 1.15, "accuracy met: J = 1", fontsize=9)
    axes.set(xscale="log", yscale="log", xlim=(10, 2e4), ylim=(floor, None))
    axes.set_xlabel("evaluations of the objective, gradients charged at their cost")
    axes.set_ylabel("best J so far: median, quartiles")
    axes.set_title(f"{SCENARIOS[0]}, {len({row['seed'] for row in rows})} seeds", fontsize=11)
    axes.legend(frameon=False, loc="lower left")
    figure.savefig(path, dpi=130)
    plt.close(figure)


if __name__ == "__main__":
    main()
